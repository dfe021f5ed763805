"""Newton's equations of the dual bound: a diagonal plus a low-rank term for w and c of each cell.

The matrix is D + S' B S, D diagonal, B of 2 x 2 blocks, S the slopes of w and c. By Woodbury's formula its inverse is

    D^-1 - D^-1 S' (B^-1 + S D^-1 S')^-1 S D^-1

and the matrix in brackets is banded, as only cells at most two apart share variables.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.planning.variables import Index

_SHARED = 2
"""Largest distance of cells that share variables."""


class DualKkt:
    """Solves the equations for N cells with G points and L variables each.

    ``columns``: (N, L), variables of each cell; ``slopes``: (N, G, 2, L), of w and c at its points.
    """

    def __init__(self, columns: Index, slopes: Array) -> None:
        count, self._points, _, width = slopes.shape
        self._columns = columns
        self._slopes = np.ascontiguousarray(slopes.reshape(count, -1, width))
        self._size = int(columns.max()) + 1
        self._block = self._slopes.shape[1]
        self._shared = [self._both(apart) for apart in range(1, min(_SHARED, count - 1) + 1)]
        self._rows = (_SHARED + 1) * self._block

    def _both(self, apart: int) -> tuple[Index, Index, Index]:
        """Variables shared by a cell and the cell ``apart`` after it: their numbers, and their places in both.

        The places are the same in all cells, except perhaps the last.
        """
        _, first, second = np.intersect1d(self._columns[0], self._columns[apart], return_indices=True)
        return self._columns[:-apart, first], first, second

    def factor(self, entries: Array) -> DualFactor:
        """The matrix with B (2, 2, N G) and D, one after the other. Raises numpy's LinAlgError if it is singular."""
        from scipy.linalg import lapack  # imported here, because that takes longer than most commands

        size = len(entries) - self._size
        (b00, b01), (_, b11) = entries[:size].reshape(2, 2, len(self._columns), self._points)
        inverse = 1.0 / entries[size:]
        slopes, block = self._slopes, self._block
        diagonal = (slopes * inverse[self._columns][:, None]) @ slopes.swapaxes(1, 2)
        determinant = b00 * b11 - b01 * b01
        point = 2 * np.arange(self._points)
        diagonal[:, point, point] += b11 / determinant
        diagonal[:, point + 1, point + 1] += b00 / determinant
        diagonal[:, point + 1, point] -= b01 / determinant
        band = np.zeros((len(slopes), block, self._rows))  # by columns: band[j][i - j] is the entry i, j
        for column in range(block):
            band[:, column, : block - column] = diagonal[:, column:, column]
        for apart, (shared, first, second) in enumerate(self._shared, 1):
            weighted = slopes[:-apart, :, first] * inverse[shared][:, None]
            other = slopes[apart:, :, second] @ weighted.swapaxes(1, 2)
            for column in range(block):
                start = apart * block - column
                band[:-apart, column, start : start + block] = other[:, :, column]
        lower, info = lapack.dpbtrf(band.reshape(-1, self._rows).T, lower=1, overwrite_ab=True)
        if info != 0:
            raise np.linalg.LinAlgError("singular")
        return DualFactor(lower, inverse, self)

    def forward(self, step: Array) -> Array:
        """Change of w and c at all points by a step: (2 N G,)."""
        return np.asarray((self._slopes @ step[self._columns][:, :, None]).ravel())

    def backward(self, weights: Array) -> Array:
        """Sum of their slopes with these weights: (n,)."""
        sums = self._slopes.swapaxes(1, 2) @ weights.reshape(len(self._slopes), -1, 1)
        return np.asarray(np.bincount(self._columns.ravel(), sums.ravel(), minlength=self._size))


@dataclass(frozen=True, eq=False)
class DualFactor:
    """A factorised matrix."""

    lower: Array
    inverse: Array
    kkt: DualKkt

    def solve(self, gradient: Array, residual: Array) -> Array:
        """The step (n,) that minimises gradient . p + p' H p / 2; ``residual`` is empty."""
        from scipy.linalg import lapack

        first = -self.inverse * gradient
        found, _ = lapack.dpbtrs(self.lower, self.kkt.forward(first), lower=1, overwrite_b=True)
        return np.asarray(first - self.inverse * self.kkt.backward(found))
