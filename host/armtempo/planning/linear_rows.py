"""Weighted sums of a few variables each, as inequalities of a motion program are, or have as derivatives."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.planning.variables import Index

if TYPE_CHECKING:
    from scipy.sparse import csr_array

_CHUNK = 8
"""Sums over the same window whose products are computed together."""


class WindowRows:
    """Weighted sums of the variables in windows (G, w), with products summed for all sums of the same window.

    ``size``: number of variables; ``of_row``: (R,), the window of each sum.
    """

    def __init__(self, size: int, windows: Index, of_row: Index) -> None:
        self._size, (count, width) = size, windows.shape
        self._indices = windows[of_row].ravel().astype(np.int32)
        self._starts = width * np.arange(len(of_row) + 1, dtype=np.int32)
        order = np.argsort(of_row, kind="stable")
        starts = np.flatnonzero(np.diff(of_row[order], prepend=-1))
        place = np.arange(len(order)) - np.repeat(starts, np.diff(starts, append=len(order)))
        chunk = np.cumsum(place % _CHUNK == 0) - 1
        self._chunks = np.full((int(chunk[-1]) + 1 if len(chunk) else 0, _CHUNK), len(order))
        """Sums of each chunk; R stands for none."""
        self._chunks[chunk, place % _CHUNK] = order
        firsts, used = chunk[starts], of_row[order[starts]]
        counts = np.diff(firsts, append=len(self._chunks))
        self._added = [
            (used[counts > number], firsts[counts > number] + number)
            for number in range(int(counts.max(initial=0)))
        ]
        """Windows that have a first chunk, a second and so on, and these chunks."""
        self._shape = count, width * width
        self.rows = np.repeat(windows, width, axis=1).ravel()
        self.columns = np.tile(windows, (1, width)).ravel()

    def matrix(self, weights: Array) -> csr_array:
        """The sums' weights (R, w) as rows of a matrix: (R, size)."""
        from scipy.sparse import csr_array  # imported here, because that takes longer than most commands

        return csr_array((weights.ravel(), self._indices, self._starts), shape=(len(weights), self._size))

    def hessian(self, weights: Array, of_rows: Array) -> Array:
        """Sums of the outer products of weights (R, w) with factors >= 0 (R,), at ``rows`` and ``columns``."""
        scaled = np.empty((len(weights) + 1, weights.shape[1]))
        np.multiply(weights, np.sqrt(of_rows)[:, None], out=scaled[:-1])
        scaled[-1] = 0.0
        each = np.take(scaled, self._chunks, axis=0)
        products = (each.swapaxes(1, 2) @ each).reshape(len(each), -1)
        found = np.zeros(self._shape)
        for number, (used, chunks) in enumerate(self._added):
            if number == 0 and len(used) == len(found):
                found = np.take(products, chunks, axis=0)
            else:
                found[used] += products[chunks]
        return found.ravel()


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
