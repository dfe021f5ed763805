"""Inequalities of a motion program that keep speed, acceleration and jerk at points of u within limits.

With derivatives by the shapes of angle and time: at a point of u let q', q'', q''' be the derivatives of an angle and
t', t'', t''' those of time. Then (Eqs. 17 to 19, the last as differentiation gives it)

    speed         q' / t'
    acceleration  (q'' t' - q' t'') / t'^3
    jerk          (q''' t'^2 - 3 q'' t' t'' + 3 q' t''^2 - q' t' t''') / t'^5
"""

from __future__ import annotations

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.planning.collocation import Ratios
from armtempo.planning.linear_rows import WindowRows
from armtempo.planning.variables import MotionVariables, angle_basis, by_differences
from armtempo.splines.trajectory import by_time


def ratios(angle: Array, time: Array, limits: Array) -> Array:
    """Signed ratios of speed, acceleration and jerk to their limits, (3, P, J).

    ``angle`` (3, P, J) holds q', q'', q''' of J joints at P points, ``time`` (3, P) t', t'', t''', ``limits`` (J, 3)
    speed, acceleration, jerk.
    """
    return np.asarray(np.stack(by_time(angle, time[:, :, None])) / limits.T[:, None, :])


def gradient(kind: int, angle: Array, time: Array) -> tuple[Array, Array]:
    """Derivatives of the speed (``kind`` 0), acceleration (1) or jerk (2) by q', q'', q''' and by t', t'', t'''.

    ``angle`` and ``time`` hold these, (3, M) each. Returns (kind + 1, M) each; derivatives by the rest are 0.
    """
    q1, q2, q3 = angle
    t1, t2, t3 = time
    i1 = 1.0 / t1
    i2 = i1 * i1
    if kind == 0:
        return i1[None], (-q1 * i2)[None]
    i3, i4 = i2 * i1, i2 * i2
    if kind == 1:
        return np.stack([-t2 * i3, i2]), np.stack([3.0 * q1 * t2 * i4 - 2.0 * q2 * i3, -q1 * i3])
    i5 = i4 * i1
    by_angle = np.stack([3.0 * t2**2 * i5 - t3 * i4, -3.0 * t2 * i4, i3])
    first = -3.0 * q3 * i4 + (12.0 * q2 * t2 + 4.0 * q1 * t3 - 15.0 * q1 * t2**2 * i1) * i5
    return by_angle, np.stack([first, 6.0 * q1 * t2 * i5 - 3.0 * q2 * i4, -q1 * i4])


class LimitRows:
    """1 - ratio > 0, then 1 + ratio > 0, for R ratios; ``limits``: (J, 3)."""

    linear = False

    def __init__(self, variables: MotionVariables, at: Ratios, limits: Array) -> None:
        self.count = 2 * len(at.kind)
        self._kinds = [np.flatnonzero(at.kind == kind) for kind in range(3)]
        self._limits = limits[at.joint, at.kind] * at.share
        self._angle_basis = angle_basis(variables.degree, at.points.u)
        self._time_basis = by_differences(self._angle_basis)
        window = at.points.segment[:, None] + np.arange(variables.degree + 1)
        self._angles = window + (at.joint * variables.angles)[:, None]
        self._times = variables.difference_index[window[:, :-1]]
        columns = np.concatenate([self._angles, self._times], axis=1)
        group = at.points.segment * len(limits) + at.joint
        self._windows = WindowRows(variables.size, columns, group)
        self.rows, self.columns = self._windows.rows, self._windows.columns

    def values(self, x: Array) -> Array:
        """See ``motion_program.Block``."""
        angle, time = self._derivatives(x)
        ratio = np.empty(len(self._limits))
        for kind, own in enumerate(self._kinds):
            ratio[own] = by_time(angle[:, own], time[:, own], kind + 1)[kind]
        ratio /= self._limits
        return np.concatenate([1.0 - ratio, 1.0 + ratio])

    def linearise(self, x: Array) -> LinearisedLimits:
        """Their derivatives at x."""
        angle, time = self._derivatives(x)
        by_angle, by_time = np.zeros((2, 3, len(self._limits)))
        for kind, own in enumerate(self._kinds):
            by_angle[: kind + 1, own], by_time[: kind + 1, own] = gradient(kind, angle[:, own], time[:, own])
        weights = np.concatenate(
            [
                np.einsum("kr,rkc->rc", by_angle / self._limits, self._angle_basis),
                np.einsum("kr,rkc->rc", by_time / self._limits, self._time_basis),
            ],
            axis=1,
        )
        return LinearisedLimits(self._windows, weights)

    def _derivatives(self, x: Array) -> tuple[Array, Array]:
        """q', q'', q''' and t', t'', t''' for each ratio: (3, R) each."""
        angle = np.einsum("rkc,rc->kr", self._angle_basis, x[self._angles])
        return angle, np.einsum("rkc,rc->kr", self._time_basis, x[self._times])


class LinearisedLimits:
    """Derivatives of the rows at one point; see ``optimise.interior_point.Linearised``."""

    def __init__(self, windows: WindowRows, weights: Array) -> None:
        self._windows, self._weights = windows, weights
        self._matrix = windows.matrix(weights)

    def forward(self, step: Array) -> Array:
        change = np.asarray(self._matrix @ step)
        return np.concatenate([-change, change])

    def backward(self, weights: Array) -> Array:
        upper, lower = np.split(weights, 2)
        return np.asarray(self._matrix.T @ (lower - upper))

    def hessian(self, weights: Array, _: Array, __: bool) -> Array:
        """See there, without the second derivatives; the entries are at ``LimitRows.rows`` and ``columns``."""
        upper, lower = np.split(weights, 2)
        return self._windows.hessian(self._weights, upper + lower)
