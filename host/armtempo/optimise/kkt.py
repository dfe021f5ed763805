"""Newton's equations of a program with sparse equalities, solved as one banded matrix.

Each variable and equality has a place on a line, and is coupled only to neighbours. Sorted by place, the matrix
[[H, A'], [A, 0]] is banded, and the time of a solve is proportional to its size.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armtempo.basics.arrays import Array

Index = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Equalities:
    """The m rows of A x = b by their entries.

    ``row``, ``column``, ``value``: (E,); ``right``: (m,); ``places``: (m,) of the rows.
    """

    row: Index
    column: Index
    value: Array
    right: Array
    places: Array

    @classmethod
    def none(cls) -> Equalities:
        """No rows."""
        empty = np.empty(0)
        index = np.empty(0, dtype=np.intp)
        return cls(index, index, empty, empty, empty)

    @property
    def count(self) -> int:
        """Number of rows."""
        return len(self.right)

    def residual(self, x: Array) -> Array:
        """b - A x: (m,)."""
        reached = np.bincount(self.row, self.value * x[self.column], minlength=self.count)
        return np.asarray(self.right - reached)


class BandedKkt:
    """Solves Newton's equations for entries of H at fixed positions.

    ``places``: (n,) of the variables; ``rows`` and ``columns``: (H,) positions of the entries of H; entries at the
    same position are added.
    """

    def __init__(self, places: Array, rows: Index, columns: Index, equalities: Equalities) -> None:
        self._size = len(places)
        self._equalities = equalities
        order = np.argsort(np.concatenate([places, equalities.places]), kind="stable")
        self._position = np.empty(len(order), dtype=np.intp)
        self._position[order] = np.arange(len(order))
        below = self._size + equalities.row
        row = self._position[np.concatenate([rows, below, equalities.column])]
        column = self._position[np.concatenate([columns, equalities.column, below])]
        self._width = int(np.max(np.abs(row - column), initial=0))
        self._flat = (2 * self._width + row - column) + (3 * self._width + 1) * column

    def factor(self, entries: Array) -> Factor:
        """Factorise the matrix with these entries of H (H,); raises numpy's LinAlgError if it is singular."""
        from scipy.linalg import lapack  # imported here, because it takes longer than most commands

        width, count = self._width, len(self._position)
        value = self._equalities.value
        weights = np.concatenate([entries, value, value])
        band = np.bincount(self._flat, weights, minlength=(3 * width + 1) * count)
        matrix, pivots, info = lapack.dgbtrf(band.reshape(count, -1).T, width, width, overwrite_ab=True)
        if info != 0:
            raise np.linalg.LinAlgError("singular")
        return Factor(matrix, pivots, width, self._position, self._size)


@dataclass(frozen=True, eq=False)
class Factor:
    """A factorised matrix of Newton's equations."""

    matrix: Array
    pivots: Index
    width: int
    position: Index
    size: int

    def solve(self, gradient: Array, residual: Array) -> Array:
        """The step (n,) that minimises gradient . p + p' H p / 2 with A p = ``residual``."""
        from scipy.linalg import lapack

        right = np.empty(len(self.position))
        right[self.position] = np.concatenate([-gradient, residual])
        found, _ = lapack.dgbtrs(self.matrix, self.width, self.width, right, self.pivots, overwrite_b=True)
        return np.asarray(found[self.position[: self.size]])
