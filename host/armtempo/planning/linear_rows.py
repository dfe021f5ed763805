"""Inequalities of a motion program that bound short weighted sums of its variables."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.planning.variables import Index

if TYPE_CHECKING:
    from scipy.sparse import csr_array


class LinearRows:
    """low < weights . x[columns] < high; if a bound is infinite there is no inequality.

    ``columns`` and ``weights``: (R, w); ``low`` and ``high``: (R,).
    """

    linear = True

    def __init__(self, size: int, columns: Index, weights: Array, low: Array, high: Array) -> None:
        self._low, self._high = low, high
        self._lower, self._upper = np.flatnonzero(np.isfinite(low)), np.flatnonzero(np.isfinite(high))
        self.count = len(self._lower) + len(self._upper)
        width = columns.shape[1]
        self.rows = np.repeat(columns, width, axis=1).ravel()
        self.columns = np.tile(columns, (1, width)).ravel()
        self._matrix = _matrix(columns, weights, size)
        self._outer = (weights[:, :, None] * weights[:, None, :]).reshape(len(weights), -1)

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
        return np.asarray(self._matrix.T @ self._per_row(weights, -1.0))

    def hessian(self, weights: Array, _: Array, __: bool) -> Array:
        """See there; the entries are at ``rows`` and ``columns``."""
        return np.asarray((self._per_row(weights, 1.0)[:, None] * self._outer).ravel())

    def _sums(self, x: Array) -> Array:
        return np.asarray(self._matrix @ x)

    def _split(self, sums: Array, low: Array | float, high: Array | float) -> Array:
        return np.concatenate([(sums - low)[self._lower], (high - sums)[self._upper]])

    def _per_row(self, weights: Array, sign: float) -> Array:
        """Of each row what its lower and its upper inequality weigh: (R,)."""
        split = len(self._lower)
        rows = np.zeros(len(self._low))
        rows[self._lower] = weights[:split]
        rows[self._upper] += sign * weights[split:]
        return rows


def _matrix(columns: Index, weights: Array, size: int) -> csr_array:
    from scipy.sparse import csr_array  # here, because loading it takes longer than most commands

    count, width = columns.shape
    starts = np.arange(0, count * width + 1, width)
    return csr_array((np.asarray(weights).ravel(), columns.ravel(), starts), shape=(count, size))
