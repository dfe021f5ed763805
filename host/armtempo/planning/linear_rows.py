"""Weighted sums of a few variables each, as inequalities of a motion program are, or have as derivatives."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.planning.variables import Index

if TYPE_CHECKING:
    from scipy.sparse import csr_array

_CHUNK = 8
"""Rows of the same variables whose products are summed together."""


class WindowRows:
    """Rows ``weights`` (R, w) of the variables ``columns`` (R, w), with products summed for rows of the same group.

    ``size``: number of variables; ``group``: (R,), rows of one group have the same variables.
    """

    def __init__(self, size: int, columns: Index, group: Index) -> None:
        self._size = size
        self._indices = columns.ravel().astype(np.int32)
        self._starts = columns.shape[1] * np.arange(len(columns) + 1, dtype=np.int32)
        order = np.argsort(group, kind="stable")
        starts = np.flatnonzero(np.diff(group[order], prepend=-1))
        place = np.arange(len(order)) - np.repeat(starts, np.diff(starts, append=len(order)))
        chunk = np.cumsum(place % _CHUNK == 0) - 1
        count = int(chunk[-1]) + 1 if len(chunk) else 0
        self._chunks = np.full((count, _CHUNK), len(order))
        """Rows of each chunk; R stands for none."""
        self._chunks[chunk, place % _CHUNK] = order
        own, width = columns[self._chunks[:, 0]], columns.shape[1]
        self.rows = np.repeat(own, width, axis=1).ravel()
        self.columns = np.tile(own, (1, width)).ravel()

    def matrix(self, weights: Array) -> csr_array:
        """The rows: (R, size)."""
        from scipy.sparse import csr_array  # imported here, because that takes longer than most commands

        return csr_array((weights.ravel(), self._indices, self._starts), shape=(len(weights), self._size))

    def hessian(self, weights: Array, of_rows: Array) -> Array:
        """Sums of the rows' outer products with factors (R,), at ``rows`` and ``columns``."""
        both = np.zeros((2, len(weights) + 1, weights.shape[1]))
        both[0, :-1], both[1, :-1] = weights, weights * of_rows[:, None]
        left, right = both[0][self._chunks], both[1][self._chunks]
        return np.asarray((left.swapaxes(1, 2) @ right).ravel())


class LinearRows:
    """low < weights . x[columns] < high; if a bound is infinite there is no inequality.

    ``columns`` and ``weights``: (R, w); ``low`` and ``high``: (R,).
    """

    linear = True

    def __init__(self, size: int, columns: Index, weights: Array, low: Array, high: Array) -> None:
        bounded = np.isfinite(low) | np.isfinite(high)
        columns, self._weights = columns[bounded], weights[bounded]
        self._low, self._high = low[bounded], high[bounded]
        self._lower, self._upper = (
            np.flatnonzero(np.isfinite(self._low)),
            np.flatnonzero(np.isfinite(self._high)),
        )
        self.count = len(self._lower) + len(self._upper)
        self._size, self._window = size, columns
        width = columns.shape[1]
        self.rows = np.repeat(columns, width, axis=1).ravel()
        self.columns = np.tile(columns, (1, width)).ravel()
        self._outer = self._weights[:, :, None] * self._weights[:, None, :]

    def values(self, x: Array) -> Array:
        """How far each sum is above its low bound, then below its high bound."""
        return self._split(self._sums(x), self._low, self._high)

    def linearise(self, _: Array) -> LinearRows:
        """Their derivatives, the same everywhere."""
        return self

    def forward(self, step: Array) -> Array:
        """See ``optimise.interior_point.Linearised``."""
        return self._split(self._sums(step), 0.0, 0.0)

    def backward(self, weights: Array) -> Array:
        values = self._weights * self._per_row(weights, -1.0)[:, None]
        return np.bincount(self._window.ravel(), values.ravel(), minlength=self._size).astype(
            float, copy=False
        )

    def hessian(self, weights: Array, _: Array, __: bool) -> Array:
        """See there; the entries are at ``rows`` and ``columns``."""
        return np.asarray((self._per_row(weights, 1.0)[:, None, None] * self._outer).ravel())

    def _sums(self, x: Array) -> Array:
        return np.asarray(np.einsum("rw,rw->r", self._weights, x[self._window]))

    def _split(self, sums: Array, low: Array | float, high: Array | float) -> Array:
        return np.concatenate([(sums - low)[self._lower], (high - sums)[self._upper]])

    def _per_row(self, weights: Array, sign: float) -> Array:
        """Of each row what its lower and its upper inequality weigh: (R,)."""
        split = len(self._lower)
        rows = np.zeros(len(self._low))
        rows[self._lower] = weights[:split]
        rows[self._upper] += sign * weights[split:]
        return rows
