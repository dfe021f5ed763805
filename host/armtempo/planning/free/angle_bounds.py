"""Bounds on the angles of a free path that hold everywhere: on the Bernstein coefficients of every segment."""

from __future__ import annotations

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.splines import bernstein, bspline


def coefficients(degree: int) -> Array:
    """Bernstein coefficients of a segment by its control points: (degree + 1, degree + 1)."""
    power = bspline.basis(degree)
    return np.asarray(bernstein.unscale(bernstein.from_power(power.T)).T)


def of_path(angle_points: Array, degree: int) -> Array:
    """Bernstein coefficients (S, degree + 1, J) of control points (S + degree, J)."""
    windows = np.lib.stride_tricks.sliding_window_view(angle_points, degree + 1, axis=0)
    return np.asarray(np.einsum("bc,sjc->sbj", coefficients(degree), windows))


class AngleRows:
    """low < coefficient < high for all Bernstein coefficients; where a bound is infinite there is no inequality.

    The first J (S + degree) of ``size`` variables are the control points, joint by joint; ``low`` and ``high``: (S,
    degree + 1, J). A coefficient that two segments share counts as one of the second. See ``motion_program.Block``.
    """

    linear = True

    def __init__(self, size: int, low: Array, high: Array) -> None:
        self._size = size
        self._segments, count, self._joints = low.shape
        own = np.ones((self._joints, self._segments, count), dtype=bool)
        own[:, :-1, -1] = False
        low, high = (np.moveaxis(each, 2, 0) for each in (low, high))
        self._lower, self._upper = (np.flatnonzero(own & np.isfinite(each)) for each in (low, high))
        self._low, self._high = low.ravel()[self._lower], high.ravel()[self._upper]
        self.count = len(self._lower) + len(self._upper)
        self._weights = coefficients(count - 1)
        self._products = (self._weights[:, :, None] * self._weights[:, None, :]).reshape(count, -1)
        joint, segment = np.divmod(np.arange(self._joints * self._segments), self._segments)
        window = (joint * (self._segments + count - 1) + segment)[:, None] + np.arange(count)
        self.rows = np.repeat(window, count, axis=1).ravel()
        self.columns = np.tile(window, (1, count)).ravel()

    def values(self, x: Array) -> Array:
        """How far each coefficient is above its low bound, then below its high bound."""
        at = self._coefficients(x)
        return np.concatenate([at[self._lower] - self._low, self._high - at[self._upper]])

    def linearise(self, _: Array) -> AngleRows:
        """Their derivatives, the same everywhere."""
        return self

    def forward(self, step: Array) -> Array:
        """See ``optimise.interior_point.Linearised``."""
        at = self._coefficients(step)
        return np.concatenate([at[self._lower], -at[self._upper]])

    def backward(self, weights: Array) -> Array:
        by_window = (self._by_coefficient(weights, -1.0) @ self._weights).reshape(
            self._joints, self._segments, -1
        )
        found = np.zeros(self._size)
        count = by_window.shape[2]
        points = found[: self._joints * (self._segments + count - 1)].reshape(self._joints, -1)
        for number in range(count):
            points[:, number : number + self._segments] += by_window[..., number]
        return found

    def hessian(self, weights: Array, _: Array, __: bool) -> Array:
        """See there; the entries are at ``rows`` and ``columns``."""
        return np.asarray((self._by_coefficient(weights, 1.0) @ self._products).ravel())

    def _coefficients(self, x: Array) -> Array:
        """All of them: (J S (degree + 1),)."""
        count = len(self._weights)
        points = x[: self._joints * (self._segments + count - 1)].reshape(self._joints, -1)
        windows = np.lib.stride_tricks.sliding_window_view(points, count, axis=1)
        return np.asarray((windows.reshape(-1, count) @ self._weights.T).ravel())

    def _by_coefficient(self, weights: Array, sign: float) -> Array:
        """Of each coefficient what its inequalities weigh, the upper one with a sign: (J S, degree + 1)."""
        found = np.zeros(self._joints * self._segments * len(self._weights))
        split = len(self._lower)
        found[self._lower] = weights[:split]
        found[self._upper] += sign * weights[split:]
        return found.reshape(-1, len(self._weights))
