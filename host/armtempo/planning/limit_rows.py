"""Inequalities of a motion program that keep speed, acceleration and jerk at points of u within limits.

With derivatives by the shapes of angle and time: at a point of u let q', q'', q''' be the derivatives of an angle and
t', t'', t''' those of time. Then (Eqs. 17 to 19, the last as differentiation gives it)

    speed         q' / t'
    acceleration  (q'' t' - q' t'') / t'^3
    jerk          (q''' t'^2 - 3 q'' t' t'' + 3 q' t''^2 - q' t' t''') / t'^5

Arrays: ``angle`` (3, P, J) holds q', q'', q''' of J joints at P points, ``time`` (3, P) t', t'', t''',
``limits`` (J, 3) speed, acceleration, jerk. The six derivatives are counted q' q'' q''' t' t'' t''' from 0.
"""

from __future__ import annotations

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.planning.collocation import Points
from armtempo.planning.variables import Index, MotionVariables, angle_basis, derivative_matrix, time_basis


def ratios(angle: Array, time: Array, limits: Array) -> Array:
    """Signed ratios of speed, acceleration and jerk to their limits: (3, P, J)."""
    q1, q2, q3 = angle
    t1, t2, t3 = time[:, :, None]
    inverse = 1.0 / t1
    speed = q1 * inverse
    acceleration = (q2 - speed * t2) * inverse**2
    jerk = (q3 - 3.0 * acceleration * t1 * t2 - speed * t3) * inverse**3
    return np.asarray(np.stack([speed, acceleration, jerk]) / limits.T[:, None, :])


def gradient(angle: Array, time: Array, limits: Array) -> Array:
    """Derivatives of each ratio by the six derivatives: (3, 6, P, J)."""
    q1, q2, q3 = angle
    t1, t2, t3 = time[:, :, None]
    i1 = 1.0 / t1
    i2, i3, i4, i5, i6 = (i1**power for power in range(2, 7))
    result = np.zeros((3, 6, *q1.shape))
    result[0, 0] = i1
    result[0, 3] = -q1 * i2
    result[1, 0] = -t2 * i3
    result[1, 1] = i2
    result[1, 3] = 3.0 * q1 * t2 * i4 - 2.0 * q2 * i3
    result[1, 4] = -q1 * i3
    result[2, 0] = 3.0 * t2**2 * i5 - t3 * i4
    result[2, 1] = -3.0 * t2 * i4
    result[2, 2] = i3
    result[2, 3] = -3.0 * q3 * i4 + 12.0 * q2 * t2 * i5 - 15.0 * q1 * t2**2 * i6 + 4.0 * q1 * t3 * i5
    result[2, 4] = 6.0 * q1 * t2 * i5 - 3.0 * q2 * i4
    result[2, 5] = -q1 * i4
    return np.asarray(result / limits.T[:, None, None, :])


class LimitRows:
    """1 - ratio > 0 and 1 + ratio > 0 for speed, acceleration and jerk of each joint at each point.

    ``points``: P of them, at least one in every segment; ``limits``: (J, 3).
    """

    linear = False

    def __init__(self, variables: MotionVariables, points: Points, limits: Array) -> None:
        self.count = 6 * len(points.u) * len(limits)
        self.limits, self._variables = limits, variables
        self._starts = np.searchsorted(points.segment, np.arange(variables.segments))
        self._bases = angle_basis(variables.degree, points.u)
        self._time_bases = time_basis(variables.degree, points.u)
        self.by_angle = derivative_matrix(self._bases, points.segment, variables.angles)
        self.by_time = derivative_matrix(self._time_bases, points.segment, variables.differences)
        self.rows, self.columns = self._pattern()

    def _pattern(self) -> tuple[Index, Index]:
        """Positions of the entries of ``_Linearised.hessian``."""
        variables = self._variables
        window = np.arange(variables.segments)[:, None]
        times = variables.difference_index[window + np.arange(variables.degree)]
        pairs = [(times, times)]
        for joint in range(variables.joints):
            own = variables.angle_index(joint)[window + np.arange(variables.degree + 1)]
            pairs.extend([(own, own), (own, times), (times, own)])
        rows, columns = [], []
        for left, right in pairs:
            full = (len(left), left.shape[1], right.shape[1])
            rows.append(np.broadcast_to(left[:, :, None], full).ravel())
            columns.append(np.broadcast_to(right[:, None, :], full).ravel())
        return np.concatenate(rows), np.concatenate(columns)

    def derivatives(self, x: Array) -> tuple[Array, Array]:
        """q', q'', q''' (3, P, J) and t', t'', t''' (3, P) at the points, or their changes by a step."""
        time = (self.by_time @ self._variables.time_differences(x)).reshape(3, -1)
        return (self.by_angle @ self._variables.angle_points(x)).reshape(3, time.shape[1], -1), time

    def gradient(self, local: Array) -> Array:
        """Gradient (n,) of a function with the derivatives ``local`` (6, P, J) by the six derivatives at each
        point."""
        by_time = self.by_time.T @ local[3:].sum(axis=2).ravel()
        by_angle = self.by_angle.T @ local[:3].reshape(-1, local.shape[2])
        return self._variables.pack(by_angle, by_time)

    def values(self, x: Array) -> Array:
        """All 1 - ratio, then all 1 + ratio: (2 * 3 * P * J,)."""
        found = ratios(*self.derivatives(x), self.limits)
        return np.concatenate([(1.0 - found).ravel(), (1.0 + found).ravel()])

    def assemble(self, local: Array) -> Array:
        """Entries of the matrix from those by the six derivatives at each point: (P, 6, J, 6)."""
        bases, (points, _, joints, _) = self._time_bases, local.shape
        by_time = bases.swapaxes(1, 2) @ (local[:, 3:, :, 3:].sum(axis=2) @ bases)
        entries = [np.add.reduceat(by_time, self._starts).ravel()]
        angles, count = bases.shape[2] + 1, 2 * bases.shape[2] + 1
        both = np.zeros((points, 6, count))
        both[:, :3, :angles], both[:, 3:, angles:] = self._bases, bases
        half = self._bases.swapaxes(1, 2) @ local[:, :3].reshape(points, 3, -1)
        whole = (half.reshape(points, angles * joints, 6) @ both).reshape(points, angles, joints, count)
        found = np.add.reduceat(whole, self._starts)
        for joint in range(joints):
            own, mixed = found[:, :, joint, :angles], found[:, :, joint, angles:]
            entries.extend([own.ravel(), mixed.ravel(), mixed.swapaxes(1, 2).ravel()])
        return np.concatenate(entries)

    def linearise(self, x: Array) -> LinearisedLimits:
        """Their derivatives at x."""
        return LinearisedLimits(self, *self.derivatives(x))


class LinearisedLimits:
    """Derivatives of the rows at one point; see ``optimise.interior_point.Linearised``."""

    def __init__(self, rows: LimitRows, angle: Array, time: Array) -> None:
        self._rows, self._angle = rows, angle
        self._gradient = gradient(angle, time, rows.limits)

    def forward(self, step: Array) -> Array:
        angle, time = self._rows.derivatives(step)
        change = np.einsum("kopj,op->kpj", self._gradient[:, 3:], time)
        change += np.einsum("kopj,opj->kpj", self._gradient[:, :3], angle)
        return np.concatenate([-change.ravel(), change.ravel()])

    def backward(self, weights: Array) -> Array:
        upper, lower = weights.reshape(2, 3, *self._angle.shape[1:])
        return self._rows.gradient(np.einsum("kopj,kpj->opj", self._gradient, lower - upper))

    def hessian(self, weights: Array, _: Array, __: bool) -> Array:
        """See there, without the second derivatives; the entries are at ``LimitRows.rows`` and ``columns``."""
        both = weights.reshape(2, 3, *self._angle.shape[1:]).sum(axis=0)
        return self._rows.assemble(
            np.einsum("kapj,kbpj->pajb", self._gradient * both[:, None], self._gradient)
        )
