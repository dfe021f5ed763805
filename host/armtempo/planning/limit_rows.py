"""Inequalities of a motion program that keep speed, acceleration and jerk at points of u within limits.

With derivatives by the shapes of angle and time: at a point of u let q', q'', q''' be the derivatives of an angle and
t', t'', t''' those of time. Then (Eqs. 17 to 19, the last as differentiation gives it)

    speed         q' / t'
    acceleration  (q'' t' - q' t'') / t'^3
    jerk          (q''' t'^2 - 3 q'' t' t'' + 3 q' t''^2 - q' t' t''') / t'^5
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.planning.collocation import Ratios
from armtempo.planning.linear_rows import WindowRows
from armtempo.planning.variables import Index, MotionVariables, angle_basis, by_differences
from armtempo.splines.trajectory import by_time

if TYPE_CHECKING:
    from scipy.sparse import csr_array


def ratios(angle: Array, time: Array, limits: Array) -> Array:
    """Signed ratios of speed, acceleration and jerk to their limits, (3, P, J).

    ``angle`` (3, P, J) holds q', q'', q''' of J joints at P points, ``time`` (3, P) t', t'', t''', ``limits`` (J, 3)
    speed, acceleration, jerk.
    """
    return np.asarray(np.stack(by_time(angle, time[:, :, None])) / limits.T[:, None, :])


def gradient(kind: int, angle: Array, time: Array) -> tuple[Array, Array]:
    """Derivatives of the speed (``kind`` 0), acceleration (1) or jerk (2) by q', q'', q''' and by t', t'', t'''.

    ``angle`` and ``time`` hold the first kind + 1 of these at least, (.., M) each. Returns (kind + 1, M) each;
    derivatives by the rest are 0.
    """
    q1, t1 = angle[0], time[0]
    i1 = 1.0 / t1
    i2 = i1 * i1
    if kind == 0:
        return i1[None], (-q1 * i2)[None]
    q2, t2 = angle[1], time[1]
    i3, i4 = i2 * i1, i2 * i2
    if kind == 1:
        return np.stack([-t2 * i3, i2]), np.stack([3.0 * q1 * t2 * i4 - 2.0 * q2 * i3, -q1 * i3])
    q3, t3 = angle[2], time[2]
    i5 = i4 * i1
    by_angle = np.stack([3.0 * t2**2 * i5 - t3 * i4, -3.0 * t2 * i4, i3])
    first = -3.0 * q3 * i4 + (12.0 * q2 * t2 + 4.0 * q1 * t3 - 15.0 * q1 * t2**2 * i1) * i5
    return by_angle, np.stack([first, 6.0 * q1 * t2 * i5 - 3.0 * q2 * i4, -q1 * i4])


class LimitRows:
    """1 - ratio > 0, then 1 + ratio > 0, for R ratios sorted by kind; ``limits``: (J, 3).

    ``order``: (R,), numbers of the sorted ratios among those given.
    """

    linear = False

    def __init__(self, variables: MotionVariables, at: Ratios, limits: Array) -> None:
        self.count = 2 * len(at.kind)
        self.order = np.argsort(at.kind, kind="stable")
        ends = np.searchsorted(at.kind[self.order], range(1, 4)).tolist()
        self._kinds = [slice(*ends) for ends in pairwise([0, *ends])]
        self._limits = (limits[at.joint, at.kind] * at.share)[self.order]
        segment, joint = at.points.segment[self.order], at.joint[self.order]
        basis = angle_basis(variables.degree, at.points.u[self.order])
        bases = basis, by_differences(basis)
        self._angle_basis, self._time_basis = (
            np.ascontiguousarray(np.moveaxis(each, 0, 2)) for each in bases
        )
        every = np.arange(variables.segments * len(limits))
        windows = np.divmod(every, len(limits))
        self._windows = WindowRows(
            variables.size, self._columns(variables, *windows), segment * len(limits) + joint
        )
        self.rows, self.columns = self._windows.rows, self._windows.columns
        self._derive = self._derivative_matrix(variables, segment, joint)
        self._known: tuple[Array, list[tuple[Array, Array]]] | None = None

    @staticmethod
    def _columns(variables: MotionVariables, segment: Index, joint: Index) -> Index:
        """Variables that act on a joint in a segment, those of its angle first: (G, 2 k + 1)."""
        window = segment[:, None] + np.arange(variables.degree + 1)
        angles = window + (joint * variables.angles)[:, None]
        return np.concatenate([angles, variables.difference_index[window[:, :-1]]], axis=1)

    def _derivative_matrix(self, variables: MotionVariables, segment: Index, joint: Index) -> csr_array:
        """Of each kind the derivatives of angles up to its order, each for all its ratios, then those of time."""
        from scipy.sparse import csr_array  # imported here, because that takes longer than most commands

        columns = self._columns(variables, segment, joint)
        width = variables.degree + 1
        data, indices, lengths = [], [], [0]
        for kind, own in enumerate(self._kinds):
            for basis, used in ((self._angle_basis, slice(width)), (self._time_basis, slice(width, None))):
                count = own.stop - own.start
                for order in range(kind + 1):
                    data.append(basis[order, :, own].T.ravel())
                    indices.append(columns[own, used].ravel())
                    lengths += [basis.shape[1]] * count
        starts = np.cumsum(lengths)
        return csr_array(
            (np.concatenate(data), np.concatenate(indices), starts), shape=(len(starts) - 1, variables.size)
        )

    def values(self, x: Array) -> Array:
        """See ``motion_program.Block``."""
        ratio = np.concatenate(
            [by_time(angle, time, kind + 1)[kind] for kind, (angle, time) in enumerate(self._derivatives(x))]
        )
        ratio /= self._limits
        return np.concatenate([1.0 - ratio, 1.0 + ratio])

    def linearise(self, x: Array) -> LinearisedLimits:
        """Their derivatives at x."""
        angles = self._angle_basis.shape[1]
        weights = np.empty((angles + self._time_basis.shape[1], len(self._limits)))
        for kind, (own, at) in enumerate(zip(self._kinds, self._derivatives(x), strict=True)):
            for slopes, basis, part in zip(
                gradient(kind, *at),
                (self._angle_basis, self._time_basis),
                (weights[:angles, own], weights[angles:, own]),
                strict=True,
            ):
                slopes = slopes / self._limits[own]
                np.multiply(slopes[0], basis[0, :, own], out=part)
                for order in range(1, kind + 1):
                    part += slopes[order] * basis[order, :, own]
        return LinearisedLimits(self._windows, np.ascontiguousarray(weights.T))

    def _derivatives(self, x: Array) -> list[tuple[Array, Array]]:
        """Of each kind k, in order from 0, the first k + 1 derivatives of angles and times: (k + 1, R_k) each."""
        if self._known is None or self._known[0] is not x:
            found, flat, end = [], self._derive @ x, 0
            for kind, own in enumerate(self._kinds):
                start, end = end, end + 2 * (kind + 1) * (own.stop - own.start)
                angle, time = flat[start:end].reshape(2, kind + 1, -1)
                found.append((angle, time))
            self._known = x, found
        return self._known[1]


class LinearisedLimits:
    """Derivatives of the rows at one point; see ``optimise.interior_point.Linearised``."""

    def __init__(self, windows: WindowRows, weights: Array) -> None:
        self._windows, self._weights = windows, weights
        self._matrix = windows.matrix(weights)
        self._transposed = self._matrix.T

    def forward(self, step: Array) -> Array:
        change = np.asarray(self._matrix @ step)
        return np.concatenate([-change, change])

    def backward(self, weights: Array) -> Array:
        upper, lower = np.split(weights, 2)
        return np.asarray(self._transposed @ (lower - upper))

    def hessian(self, weights: Array, _: Array, __: bool) -> Array:
        """See there, without the second derivatives; the entries are at ``LimitRows.rows`` and ``columns``."""
        upper, lower = np.split(weights, 2)
        return self._windows.hessian(self._weights, upper + lower)
