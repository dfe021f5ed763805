"""Inequalities of a time axis on a fixed path: speed, acceleration and jerk at points of u within limits.

Only rows that could become active are used: at a point, one joint's speed bounds t' first, and one joint's
acceleration bounds t'', or its jerk t''', which bounds those of the others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.planning import limit_rows
from armtempo.planning.collocation import Points
from armtempo.planning.variables import Index, MotionVariables, derivative_matrix, time_basis

_PEAK_THRESHOLD = 0.8
"""Rows whose ratio could reach this fraction of the limit are used."""


@dataclass(frozen=True, eq=False)
class Rows:
    """M rows, in the order speeds, accelerations, jerks.

    ``point``: (M,); ``slopes``: (3, M), q', q'', q''' of the row's joint over its limit, with the row's sign;
    ``kinds``: the rows of each of the three.
    """

    point: Index
    slopes: Array
    kinds: tuple[slice, slice, slice]

    @classmethod
    def reachable(cls, angle: Array, times: Sequence[Array], limits: Array) -> Rows:
        """The rows that could become active near time axes ``times``, each (3, P), at points with ``angle``
        (3, P, J)."""
        watched = [_reachable(angle, time, limits) for time in times]
        points, slopes, ends = [], [], [0]
        for kind in range(3):
            sign, point, joint = np.nonzero(np.any([one[kind] for one in watched], axis=0))
            points.append(point)
            slopes.append(angle[:, point, joint] * (1.0 - 2.0 * sign) / limits[joint, kind])
            ends.append(ends[-1] + len(point))
        speed, acceleration, jerk = map(slice, ends, ends[1:])
        return cls(np.concatenate(points), np.concatenate(slopes, axis=1), (speed, acceleration, jerk))

    def ratios(self, times: Array) -> Array:
        """Their ratios to the limits, (M,), with t', t'', t''' (3, M) there; see ``limit_rows``."""
        t1, t2, t3 = times
        q1, q2, q3 = self.slopes
        _, a, j = self.kinds
        inverse = 1.0 / t1
        found = q1 * inverse
        later = slice(a.start, None)
        acceleration = (q2[later] - found[later] * t2[later]) * inverse[later] ** 2
        third = acceleration[j.start - a.start :]
        found[j] = (q3[j] - 3.0 * third * t1[j] * t2[j] - found[j] * t3[j]) * inverse[j] ** 3
        found[a] = acceleration[: a.stop - a.start]
        return np.asarray(found)

    def gradient(self, times: Array) -> Array:
        """Their derivatives by t', t'', t''': (3, M)."""
        t1, t2, t3 = times
        q1, q2, q3 = self.slopes
        v, a, j = self.kinds
        i1 = 1.0 / t1
        i2 = i1 * i1
        i3, i4 = i2 * i1, i2 * i2
        found = np.zeros_like(times)
        found[0, v] = -q1[v] * i2[v]
        found[0, a] = 3.0 * q1[a] * t2[a] * i4[a] - 2.0 * q2[a] * i3[a]
        found[1, a] = -q1[a] * i3[a]
        by_t2 = (6.0 * q1[j] * t2[j] * i1[j] - 3.0 * q2[j]) * i4[j]
        found[0, j] = -3.0 * q3[j] * i4[j] + (4.0 * q1[j] * t3[j] + 12.0 * q2[j] * t2[j]) * i4[j] * i1[j]
        found[0, j] -= 15.0 * q1[j] * t2[j] ** 2 * i4[j] * i2[j]
        found[1, j] = by_t2
        found[2, j] = -q1[j] * i4[j]
        return found

    def curvature(self, times: Array, weights: Array) -> dict[tuple[int, int], Array]:
        """Their second derivatives by t', t'', t''' times ``weights`` (M,), those that are not 0: each (M,)."""
        t1, t2, t3 = times
        q1, q2, q3 = self.slopes * weights
        v, a, j = self.kinds
        i1 = 1.0 / t1
        i2 = i1 * i1
        i3, i4 = i2 * i1, i2 * i2
        i5, i6 = i4 * i1, i4 * i2
        first, mixed, outer, second = (np.zeros_like(t1) for _ in range(4))
        first[v] = 2.0 * q1[v] * i3[v]
        first[a] = 6.0 * q2[a] * i4[a] - 12.0 * q1[a] * t2[a] * i5[a]
        mixed[a] = 3.0 * q1[a] * i4[a]
        first[j] = 12.0 * q3[j] * i5[j] - (60.0 * q2[j] * t2[j] + 20.0 * q1[j] * t3[j]) * i6[j]
        first[j] += 90.0 * q1[j] * t2[j] ** 2 * i6[j] * i1[j]
        mixed[j] = 12.0 * q2[j] * i5[j] - 30.0 * q1[j] * t2[j] * i6[j]
        outer[j] = 4.0 * q1[j] * i5[j]
        second[j] = 6.0 * q1[j] * i5[j]
        return {(0, 0): first, (0, 1): mixed, (0, 2): outer, (1, 1): second}


def _reachable(angle: Array, time: Array, limits: Array) -> list[Array]:
    """Whether a row could be reached, by its sign: three times (2, P, J)."""
    ratios = limit_rows.ratios(angle, time, limits)
    points = np.arange(angle.shape[1])
    first = np.abs(angle[0]) / limits[:, 0]
    fastest = first.argmax(axis=1)
    found = [np.zeros((2, *angle.shape[1:]), dtype=bool)]
    found[0][(angle[0, points, fastest] < 0.0).astype(np.intp), points, fastest] = True
    for kind in (1, 2):
        # t'' or t''' changes the ratios of all joints in proportion to their effect, until the joint with the
        # largest effect reaches its limit
        effect = angle[0] / limits[:, kind]
        largest = points, np.abs(effect).argmax(axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            part = np.nan_to_num(effect / effect[largest][:, None])
        centre = ratios[kind] - part * ratios[kind][largest][:, None]
        found.append(np.stack([centre, -centre]) + np.abs(part) > _PEAK_THRESHOLD)
    return found


class PathRows:
    """1 - ratio > 0 for each row, a block of a motion program in which only time varies."""

    linear = False

    def __init__(self, variables: MotionVariables, points: Points, rows: Rows) -> None:
        self.count = len(rows.point)
        self.limits = rows
        self._basis = time_basis(variables.degree, points.u)
        self._derived = derivative_matrix(self._basis, points.segment, variables.differences)
        self._starts = np.searchsorted(points.segment, np.arange(variables.segments))
        index = np.arange(variables.segments)[:, None] + np.arange(variables.degree)
        self.rows = np.repeat(index, variables.degree, axis=1).ravel()
        self.columns = np.tile(index, (1, variables.degree)).ravel()

    def times(self, x: Array) -> Array:
        """t', t'', t''' of each row, (3, M), or their changes by a step."""
        return np.asarray((self._derived @ x).reshape(3, -1)[:, self.limits.point])

    def values(self, x: Array) -> Array:
        """See ``motion_program.Block``: (M,)."""
        return 1.0 - self.limits.ratios(self.times(x))

    def linearise(self, x: Array) -> LinearisedPath:
        """See there."""
        return LinearisedPath(self, self.times(x))

    def spread(self, by_times: Array) -> Array:
        """Gradient (n,) of a function with the derivatives (3, M) by t', t'', t''' of the rows."""
        return np.asarray(self._derived.T @ np.concatenate([self._sums(one) for one in by_times]))

    def assemble(self, by_times: dict[tuple[int, int], Array]) -> Array:
        """Entries of the matrix from second derivatives (M,) by t', t'', t'''."""
        by_point = np.zeros((len(self._basis), 3, 3))
        for (row, column), values in by_times.items():
            by_point[:, row, column] = by_point[:, column, row] = self._sums(values)
        entries = self._basis.swapaxes(1, 2) @ (by_point @ self._basis)
        return np.add.reduceat(entries, self._starts).ravel()

    def _sums(self, values: Array) -> Array:
        """Sums over the rows of each point: (P,)."""
        return np.asarray(np.bincount(self.limits.point, values, minlength=len(self._basis)))


class LinearisedPath:
    """Derivatives of the rows at one point; see ``optimise.interior_point.Linearised``."""

    def __init__(self, block: PathRows, times: Array) -> None:
        self._block, self._times = block, times
        self._gradient = block.limits.gradient(times)

    def forward(self, step: Array) -> Array:
        return np.asarray(-np.sum(self._gradient * self._block.times(step), axis=0))

    def backward(self, weights: Array) -> Array:
        return self._block.spread(-self._gradient * weights)

    def hessian(self, weights: Array, multipliers: Array, exact: bool) -> Array:
        """See there; the entries are at ``PathRows.rows`` and ``columns``."""
        weighted = self._gradient * weights
        pairs = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)]
        entries = {pair: weighted[pair[0]] * self._gradient[pair[1]] for pair in pairs}
        if exact:
            for pair, bent in self._block.limits.curvature(self._times, multipliers).items():
                entries[pair] += bent
        return self._block.assemble(entries)
