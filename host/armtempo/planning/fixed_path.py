"""The optimal time axis of a fixed path, with a given number of segments per path segment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.model.parts import Limits
from armtempo.optimise import interior_point
from armtempo.optimise.interior_point import Schedule
from armtempo.optimise.kkt import Equalities
from armtempo.planning import collocation, limit_rows
from armtempo.planning.collocation import Curve, Points
from armtempo.planning.motion_program import MotionProgram, time_weights
from armtempo.planning.variables import Index, MotionVariables, derivative_matrix, time_basis, time_points
from armtempo.splines import bspline, time_axis

_LEAST_SHARE = 0.8
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
        found.append(np.stack([centre, -centre]) + np.abs(part) > _LEAST_SHARE)
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


_ROUNDS = 12
"""Largest number of solves, each with the peaks of the previous solution as new points."""
_PARTS, _LEAST_PARTS, _POINTS = 64, 4, 2000
"""Points per path segment, divided among its time segments; least points per time segment; largest total."""
_PEAK_THRESHOLD = 0.95
"""Peaks of at least this fraction of a limit become points."""
_PEAK_GRID_FACTOR = 4
"""Factor by which the grid for the search of peaks is finer."""
_AWAY = 1.003
"""Factor on time before each solve, for a start within the limits."""
_COARSE = Schedule(first_barrier=1e-2, last_barrier=1e-5)
_AGAIN = 3e-4
"""Initial barrier parameter of all solves after the first."""


@dataclass(frozen=True, eq=False)
class Optimum:
    """A time axis within all limits, and a bound of the local optimum."""

    differences_s: Array
    """Differences of the time control points, (m + degree - 1,)."""
    total_s: float
    bound_s: float
    """Lower bound of the local optimum with the same variables; 0 if not known."""


@dataclass(frozen=True, eq=False)
class Along:
    """Further quantities with limits along a path: the way of the tool, or components of it.

    ``pieces``: power coefficients on each segment of the time axis, (V, m, degree + 1), only used for
    derivatives; ``limits``: of the first three time derivatives, (V, 3).
    """

    pieces: Array
    limits: Array


class FixedPath:
    """A path with limits, whose time axis has ``refine`` segments per path segment.

    ``angle_points_deg``: (n + degree, J); ``limits``: one per joint. With ``mirrored`` ends the axis is given
    by intervals (``time_axis.step_map``), else all differences of its control points are free. ``along``:
    further quantities with limits.
    """

    def __init__(
        self, angle_points_deg: Array, degree: int, limits: Sequence[Limits], refine: int = 1,
        mirrored: bool = False, along: Along | None = None,
    ) -> None:  # fmt: skip
        pieces = bspline.subdivide(bspline.polynomials(angle_points_deg, degree), refine)
        self.degree, self.refine = degree, refine
        self.variables = MotionVariables(len(pieces), degree, 0)
        self.angle = np.ascontiguousarray(np.moveaxis(pieces, 2, 0))
        self.limits = np.array([limit.values for limit in limits])
        if along is not None:
            self.angle = np.concatenate([self.angle, along.pieces])
            self.limits = np.concatenate([self.limits, along.limits])
        self._weights = time_weights(self.variables)
        self._equalities = _mirror(self.variables) if mirrored else Equalities.none()

    def curve(self, differences_s: Array) -> Curve:
        """The motion on this time axis."""
        times = bspline.polynomials(time_points(differences_s, self.degree), self.degree)
        return Curve(self.angle, times, self.limits)

    def of_intervals(self, intervals_s: Array) -> Array:
        """Differences (n + degree - 1,) of the mirrored axis with these intervals (n,)."""
        return np.asarray(intervals_s[time_axis.mirrored(len(intervals_s), (self.degree - 1) // 2)])

    def intervals(self, differences_s: Array) -> Array:
        """Intervals (n,) of a mirrored axis."""
        edge = (self.degree - 1) // 2
        return differences_s[edge : len(differences_s) - edge]

    def duration_s(self, differences_s: Array) -> float:
        """Its motion time."""
        return float(self._weights @ differences_s)

    def scaled(self, differences_s: Array) -> Array:
        """The axis scaled so that the motion just keeps every limit, proven."""
        return np.asarray(differences_s * self.curve(differences_s).scale())

    def optimum(self, differences_s: Array, gap: float) -> Optimum:
        """The local optimum from a start (m + degree - 1,), which is scaled first; never slower than that.

        Ends within a relative ``gap`` of the bound, or if further rounds do not help.
        """
        best = self.scaled(differences_s)
        parts = max(_LEAST_PARTS, min(_PARTS // self.refine, _POINTS // self.variables.segments))
        points = collocation.grid(self.variables.segments, parts, ends=self.degree == 3)
        settings, bound, here = _COARSE, 0.0, best
        seen: list[Array] = []
        for _ in range(_ROUNDS):
            if not np.all(np.isfinite(here) & (here > 0.0)):
                break
            seen.append(here)
            here, bound = self._solve(seen, points, settings)
            curve = self.curve(here)
            scale = curve.scale()
            if self.duration_s(here) * scale < self.duration_s(best):
                best = here * scale
            if bound and self.duration_s(best) <= bound * (1.0 + gap):
                break
            points += collocation.peaks(curve, _PEAK_GRID_FACTOR * parts, _PEAK_THRESHOLD).points
            here = here * scale
            settings = Schedule(_AGAIN, min(_AGAIN, 0.3 * gap))
        return Optimum(best, self.duration_s(best), min(bound, self.duration_s(best)))

    def _solve(self, seen: list[Array], points: Points, settings: Schedule) -> tuple[Array, float]:
        """The optimal axis within the limits at these points, and a lower bound of its motion time.

        Starts from the last axis in ``seen``; constraints are those that could be reached near any of them.
        """
        differences_s = seen[-1]
        unit_s = self.duration_s(differences_s) / self.variables.segments
        limits = self.limits * unit_s ** np.arange(1, 4)
        angle = np.stack([_at(self.angle, points, order) for order in (1, 2, 3)])
        basis, window = time_basis(self.degree, points.u), points.segment[:, None] + np.arange(self.degree)
        times = [(basis @ (one / unit_s)[window][:, :, None])[..., 0].T for one in seen]
        rows = PathRows(self.variables, points, Rows.reachable(angle, times, limits))
        program = MotionProgram(self.variables, [rows], self._equalities)
        found = interior_point.minimise(program, differences_s / unit_s * _AWAY, settings)
        here = found.x * unit_s
        bound = self.duration_s(here) * (1.0 - 2.0 * settings.last_barrier) if found.converged else 0.0
        return here, bound


def _at(angle: Array, points: Points, order: int) -> Array:
    """Derivatives of angles (J, S, k + 1) at points (P,): (P, J)."""
    derived = bspline.derivative(np.moveaxis(angle, 0, 2), order)
    powers = points.u[:, None] ** np.arange(derived.shape[1])
    return np.asarray(np.einsum("pc,pcj->pj", powers, derived[points.segment]))


def _mirror(variables: MotionVariables) -> Equalities:
    """Equalities of a mirrored axis: differences at both ends are equal in pairs."""
    edge = (variables.degree - 1) // 2
    mirrored = time_axis.mirrored(variables.segments, edge) + edge
    own = np.flatnonzero(mirrored != np.arange(len(mirrored)))
    row = np.arange(len(own))
    places = variables.places
    return Equalities(
        np.concatenate([row, row]),
        np.concatenate([own, mirrored[own]]),
        np.repeat([1.0, -1.0], len(own)),
        np.zeros(len(own)),
        0.5 * (places[own] + places[mirrored[own]]),
    )
