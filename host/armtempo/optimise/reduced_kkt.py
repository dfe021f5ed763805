"""Newton's equations of a program whose Hessian is positive definite: equalities eliminated, Cholesky of a band.

Each row of A x = b gives one variable by its neighbours. With the others, y, x = x0 + Z y, and Z' H Z is a band about
as wide as that of H. Its factors take a quarter of the time of those of ``kkt.BandedKkt``, where H need not be
definite. (Nocedal and Wright, Numerical Optimization, 2nd ed., chapters 15.3 and 16.2.)
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.optimise.kkt import Equalities, Index

if TYPE_CHECKING:
    from scipy.sparse import csr_array

_DEPENDENT = 1e-10
"""A row of which no more than this part is left by the others depends on them."""


class ReducedKkt:
    """Solves Newton's equations for entries of H at fixed positions; arguments as of ``kkt.BandedKkt``."""

    def __init__(self, places: Array, rows: Index, columns: Index, equalities: Equalities) -> None:
        try:
            self._reduction: Reduction | None = Reduction(places, equalities)
        except np.linalg.LinAlgError:
            self._reduction = None
            return
        self._products = products = self._reduction.products(rows, columns)
        self._width = int(np.max(products.rows - products.columns, initial=0))
        self._flat = products.rows + self._width * products.columns
        across = np.flatnonzero(self._reduction.eliminated[columns])
        self._across = across, rows[across], columns[across]
        """Entries in columns of eliminated variables, and their positions."""

    def factor(self, entries: Array) -> ReducedFactor:
        """Factorise the matrix with these entries of H (H,); raises numpy's LinAlgError if it is not definite, or
        equalities depend on each other."""
        from scipy.linalg import lapack  # imported here, because it takes longer than most commands

        if self._reduction is None:
            raise np.linalg.LinAlgError("equalities depend on each other")
        size = (self._width + 1) * self._reduction.count
        band = np.bincount(
            self._flat, entries[self._products.entries] * self._products.weights, minlength=size
        )
        lower, info = lapack.dpbtrf(band.reshape(self._reduction.count, -1).T, lower=True, overwrite_ab=True)
        if info != 0:
            raise np.linalg.LinAlgError("not positive definite")
        which, rows, columns = self._across
        return ReducedFactor(lower, self._reduction, rows, columns, entries[which])


@dataclass(frozen=True, eq=False)
class ReducedFactor:
    """Factors of Z' H Z (f, f), and the entries of H in columns of eliminated variables."""

    lower: Array
    reduction: Reduction
    rows: Index
    columns: Index
    entries: Array

    def solve(self, gradient: Array, residual: Array) -> Array:
        """The step (n,) that minimises gradient . p + p' H p / 2 with A p = ``residual``."""
        from scipy.linalg import lapack

        shift = self.reduction.shift(residual)
        pull = np.bincount(self.rows, self.entries * shift[self.columns], minlength=len(shift)) + gradient
        found, _ = lapack.dpbtrs(
            self.lower, -(self.reduction.transposed @ pull), lower=True, overwrite_b=True
        )
        return np.asarray(shift + self.reduction.basis @ found)


class Products(NamedTuple):
    """What entries of H add to the lower half of Z' H Z: rows and columns there, numbers of the entries, weights."""

    rows: Index
    columns: Index
    entries: Index
    weights: Array


class Reduction:
    """The variables (n,) that meet A x = b, by f of them, sorted by place: x = x0 + Z y.

    ``basis``: Z, (n, f); ``eliminated``: whether a variable is given by others, (n,).
    """

    def __init__(self, places: Array, equalities: Equalities) -> None:
        """Raises numpy's LinAlgError if rows depend on each other."""
        from scipy.sparse import csr_array

        size = len(places)
        solved = _Solved(equalities)
        pivots = np.array(list(solved.rows), dtype=np.intp)
        self.eliminated = np.zeros(size, dtype=bool)
        self.eliminated[pivots] = True
        free = np.flatnonzero(~self.eliminated)
        free = free[np.argsort(places[free], kind="stable")]
        self.count = len(free)
        self._position = np.zeros(size, dtype=np.intp)
        self._position[free] = np.arange(self.count)
        left, right, value = _entries(solved.rows.values())
        self.basis: csr_array = csr_array(
            (
                np.concatenate([np.ones(self.count), -value]),
                (np.concatenate([free, pivots[left]]), self._position[np.concatenate([free, right])]),
            ),
            shape=(size, self.count),
        )
        self.transposed: csr_array = self.basis.T.tocsr()
        left, right, value = _entries(solved.rights.values())
        self._shift: csr_array = csr_array((value, (pivots[left], right)), shape=(size, equalities.count))

    def shift(self, right: Array) -> Array:
        """x0 (n,) that meets A x = ``right`` (m,), with y = 0."""
        return np.asarray(self._shift @ right)

    def products(self, rows: Index, columns: Index) -> Products:
        """Of entries of H (H,) at ``rows`` and ``columns``."""
        single = ~(self.eliminated[rows] | self.eliminated[columns])
        one, entry = np.flatnonzero(single), np.flatnonzero(~single)
        starts, z_columns, z_values = self.basis.indptr, self.basis.indices, self.basis.data
        counts = np.diff(starts)
        inner = counts[columns[entry]]
        each = counts[rows[entry]] * inner
        entry, inner = np.repeat(entry, each), np.repeat(inner, each)
        place = np.arange(len(entry)) - np.repeat(np.cumsum(each) - each, each)
        left, right = starts[rows[entry]] + place // inner, starts[columns[entry]] + place % inner
        own = np.concatenate([self._position[rows[one]], z_columns[left]])
        others = np.concatenate([self._position[columns[one]], z_columns[right]])
        weights = np.concatenate([np.ones(len(one)), z_values[left] * z_values[right]])
        lower = np.flatnonzero(own >= others)
        return Products(own[lower], others[lower], np.concatenate([one, entry])[lower], weights[lower])


class _Solved:
    """Rows of equalities, each solved for one variable by those that no row is solved for.

    ``rows``: by solved variable, the coefficients of others; ``rights``: by the same, of the right sides.
    """

    def __init__(self, equalities: Equalities) -> None:
        self.rows: dict[int, dict[int, float]] = {}
        self.rights: dict[int, dict[int, float]] = {}
        self._users: defaultdict[int, set[int]] = defaultdict(set)
        """Solved variables whose rows have a variable."""
        given: list[dict[int, float]] = [{} for _ in range(equalities.count)]
        of_rows, columns, values = (
            equalities.row.tolist(),
            equalities.column.tolist(),
            equalities.value.tolist(),
        )
        for number, column, value in zip(of_rows, columns, values, strict=True):
            given[number][column] = given[number].get(column, 0.0) + value
        for number, row in enumerate(given):
            self._add(row, {number: 1.0})

    def _add(self, row: dict[int, float], right: dict[int, float]) -> None:
        largest = max(map(abs, row.values()), default=0.0)
        for column in [column for column in row if column in self.rows]:
            factor = row.pop(column)
            _subtract(row, factor, self.rows[column])
            _subtract(right, factor, self.rights[column])
        pivot = max(row, key=lambda column: abs(row[column]), default=-1)
        if pivot < 0 or abs(row[pivot]) <= _DEPENDENT * largest:
            raise np.linalg.LinAlgError("equalities depend on each other")
        divisor = row.pop(pivot)
        row = {column: value / divisor for column, value in row.items()}
        right = {number: value / divisor for number, value in right.items()}
        for other in self._users.pop(pivot, ()):
            factor = self.rows[other].pop(pivot)
            _subtract(self.rows[other], factor, row)
            _subtract(self.rights[other], factor, right)
            for column in row:
                self._users[column].add(other)
        self.rows[pivot], self.rights[pivot] = row, right
        for column in row:
            self._users[column].add(pivot)


def _subtract(row: dict[int, float], factor: float, other: dict[int, float]) -> None:
    for column, value in other.items():
        row[column] = row.get(column, 0.0) - factor * value


def _entries(rows: Iterable[dict[int, float]]) -> tuple[Index, Index, Array]:
    """Row numbers, columns and values of all entries."""
    kept = list(rows)
    number = np.repeat(np.arange(len(kept)), [len(row) for row in kept])
    columns = np.array([column for row in kept for column in row], dtype=np.intp)
    return number, columns, np.array([value for row in kept for value in row.values()], dtype=np.float64)
