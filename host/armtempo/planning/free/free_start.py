"""Start motions for a free path: through all via points, with the rests, within ranges and corridor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.errors import PlanError
from armtempo.optimise import interior_point
from armtempo.optimise.interior_point import Linearised, Schedule
from armtempo.optimise.kkt import BandedKkt, Equalities
from armtempo.planning.free import angle_bounds
from armtempo.planning.free.angle_bounds import AngleRows
from armtempo.planning.free.free_motion import Demand, FreeMotion, Improver, bounds, met
from armtempo.planning.free.layout import DEGREE, Layout, Vias, uniform
from armtempo.planning.linear_rows import LinearRows
from armtempo.planning.variables import MotionVariables
from armtempo.splines import bspline

_LEAST_STEP = 1e-3
"""Least difference of time control points, as a part of the largest."""
_CENTRE = Schedule(first_barrier=1e3, last_barrier=1e3, iterations=30, curvature=False)
"""Settings that prefer a large margin over similarity."""
_NEAR = Schedule(first_barrier=10.0, last_barrier=1e-10, curvature=False)
_OFF = Schedule(first_barrier=10.0, last_barrier=1e-3, curvature=False)
_TOO_NEAR = 1e-9
"""A path closer to a bound than this (in the unit of the angles) is moved farther away, even if it becomes
less similar: otherwise Newton's equations of the following solve lose all digits."""
_WIDER = 2.0
"""Bounds are widened by this factor times the path's excess."""
_BETTER, _STEPS = 0.99, 60
_MARGIN, _MOST_MARGIN = 0.25, 1e-7
"""Margin to the bounds: fraction of the margin, and largest value in the unit of the angles."""


def along_spline(demand: Demand, pieces: int, times_s: Array) -> FreeMotion:
    """The spline through the via points with ``pieces`` segments between two of them, for times (n,) between them."""
    layout = uniform(len(demand.via_deg), pieces, demand.stops)
    points = bspline.refined(bspline.fit(demand.via_deg, DEGREE), pieces, DEGREE)
    if demand.stops:
        return smooth(demand, layout, times_s)
    return _met(demand, layout, points, _differences(layout, times_s / pieces), smooth=False)


def on_time_axis(demand: Demand, differences_s: Array) -> FreeMotion:
    """The spline through the via points on a time axis (S + 4,) with the same number of segments per leg."""
    legs = len(demand.via_deg) - 1
    pieces = (len(differences_s) - DEGREE + 1) // legs
    return replace(along_spline(demand, pieces, np.ones(legs)), differences_s=differences_s)


def smooth(demand: Demand, layout: Layout, times_s: Array) -> FreeMotion:
    """The path with the least squared third differences of control points, for times (n,) between the via points."""
    rough = np.empty((layout.segments + DEGREE, demand.via_deg.shape[1]))
    place = np.arange(len(rough)) - 0.5 * (DEGREE - 1)
    knots = np.stack([layout.arrivals, layout.departures()], axis=1).ravel()
    for joint, angles in enumerate(demand.via_deg.T):
        rough[:, joint] = np.interp(place, knots, np.repeat(angles, 2))
    return _met(demand, layout, rough, _differences(layout, times_s / layout.pieces), smooth=True)


def resampled(demand: Demand, layout: Layout, motion: FreeMotion) -> FreeMotion:
    """A motion resampled to another layout, with segments of about equal time between two via points."""
    curve = motion.curve(demand.limits)
    times = motion.via_times_s
    leaves = times + np.array([motion.layout.stops.get(via, 0.0) for via in range(len(times))])
    steps_s = motion.leg_times_s / layout.pieces
    knots = [np.array([0.0])]
    for via, (step, count) in enumerate(zip(steps_s, layout.pieces, strict=True)):
        if layout.arrivals[via] < layout.departures()[via]:
            knots.append(np.full(layout.departures()[via] - layout.arrivals[via], leaves[via]))
        knots.append(leaves[via] + step * np.arange(1, count + 1))
    times_s = np.concatenate(knots)
    angles = curve.angles_at(np.minimum(times_s, times[-1]))
    return _met(demand, layout, bspline.fit(angles, DEGREE), _passing(times_s), smooth=False)


def _passing(times_s: Array) -> Array:
    """Differences (S + 4,) of control points whose spline has these times (S + 1,) at its knots."""
    variables = MotionVariables(len(times_s) - 1, DEGREE, 1)
    weights = bspline.basis(DEGREE)[0, :DEGREE]
    columns = np.arange(len(times_s))[:, None] + np.arange(DEGREE)
    rows = Equalities(
        np.repeat(np.arange(len(times_s)), DEGREE),
        columns.ravel(),
        np.tile(weights, len(times_s)),
        times_s,
        0.5 * (DEGREE - 1) + np.arange(len(times_s), dtype=np.float64),
    )
    x = met(variables, rows, np.zeros(variables.size), smooth=True)
    return np.diff(variables.angle_points(x)[:, 0])


def _differences(layout: Layout, steps_s: Array) -> Array:
    """Differences of time control points for given times between the via points, (n,)."""
    arrivals, departures = layout.arrivals, layout.departures()
    segments = np.empty(layout.segments)
    for via, step in enumerate(steps_s):
        segments[arrivals[via] : arrivals[via + 1]] = step
        if departures[via] > arrivals[via]:
            segments[arrivals[via] : departures[via]] = layout.stops[via] / (departures[via] - arrivals[via])
    own = np.clip(np.arange(layout.segments + DEGREE - 1) - (DEGREE - 1) // 2, 0, layout.segments - 1)
    return segments[own]


def _met(demand: Demand, layout: Layout, points: Array, differences_s: Array, smooth: bool) -> FreeMotion:
    """The motion with control points changed so that via points, rests and dwells are met."""
    improver = Improver(demand, layout)
    x = improver.variables.pack(points / demand.size_deg, differences_s)
    x = met(improver.variables, improver.equalities(1.0), x, smooth)
    steps = np.maximum(differences_s, _LEAST_STEP * differences_s.max())
    motion = FreeMotion(layout, improver.variables.angle_points(x) * demand.size_deg, steps)
    return _inside(demand, motion)


def _inside(demand: Demand, motion: FreeMotion) -> FreeMotion:
    """The motion, changed as needed to keep ranges and corridor."""
    layout, size = motion.layout, demand.size_deg
    low, high = bounds(demand, layout)
    points = motion.angle_points_deg.copy()
    variables = MotionVariables(layout.segments, DEGREE, 1)
    vias = Vias(demand.via_deg / size, demand.turning)
    for joint, name in enumerate(demand.names):
        one = slice(joint, joint + 1)
        allowed = low[..., one] / size[joint], high[..., one] / size[joint]
        fixed = layout.angle_equalities(variables, vias.joint(joint))
        margins = demand.margin_deg[~demand.turning[:, joint], joint]
        margin = min(margins.min(initial=np.inf), demand.corridor_deg) / size[joint]
        found = _nearest(allowed, margin, fixed, points[:, joint] / size[joint])
        if found is None:
            raise PlanError(
                f"{name}: no path with {layout.pieces.min()} pieces between via points stays within its range and "
                "corridor",
                "raise refine, widen the corridor, or move the via points away from the end of the range",
            )
        points[:, joint] = found * size[joint]
    return replace(motion, angle_points_deg=points)


def _nearest(allowed: tuple[Array, Array], margin: float, fixed: Equalities, wanted: Array) -> Array | None:
    """Control points (C,) that meet ``fixed``, keep their Bernstein coefficients within the lowest and highest
    ``allowed``, (S, 6, 1) each, and are nearest to ``wanted`` (C,).

    The distance is the sum of squared third differences. The bounds are first widened until ``wanted``, which
    meets ``fixed``, keeps them, and then narrowed again around their middle until the path keeps a margin, a
    fraction of ``margin``, which is the distance of the fixed values from the bounds. None if that is not
    possible.
    """
    x, margin = wanted, min(_MARGIN * margin, _MOST_MARGIN)
    excess = _excess(allowed, x) + margin
    if excess < min(margin - _TOO_NEAR, 0.0):
        return x
    for _ in range(_STEPS):
        if excess <= 0.5 * margin:
            break
        program = _Alike(allowed, _WIDER * excess - margin, fixed, wanted)
        x = interior_point.minimise(program, x, _CENTRE).x
        before, excess = excess, _excess(allowed, x) + margin
        if not excess < _BETTER * before:
            return None
    program = _Alike(allowed, 0.0, fixed, wanted)
    found = interior_point.minimise(program, x, _NEAR)
    if found.iterations and _excess(allowed, found.x) > -_TOO_NEAR:
        found = interior_point.minimise(program, x, _OFF)
    return found.x if found.iterations else None


def _excess(allowed: tuple[Array, Array], x: Array) -> float:
    """Largest excess of a Bernstein coefficient over its bounds; negative if all are inside."""
    low, high = allowed
    at = angle_bounds.of_path(x[:, None], DEGREE)
    return float(np.max(np.maximum(low - at, at - high)))


class _Alike:
    """The program: relative squared third differences from ``wanted``, within widened bounds."""

    def __init__(
        self, allowed: tuple[Array, Array], wider: float, equalities: Equalities, wanted: Array
    ) -> None:
        self.equalities, self._wanted = equalities, wanted
        count = len(wanted)
        low, high = allowed
        bounds = AngleRows(count, low - wider, high + wider)
        self._bounds = bounds
        self._scale = 1.0 / max(float(np.sum(np.diff(wanted, 3) ** 2)), 1e-300)
        self._third = LinearRows(
            count,
            np.arange(count - 3)[:, None] + np.arange(4),
            np.broadcast_to([-1.0, 3.0, -3.0, 1.0], (count - 3, 4)),
            np.full(count - 3, -np.inf),
            np.zeros(count - 3),
        )
        self.kkt = BandedKkt(
            np.arange(count, dtype=float),
            np.concatenate([self._third.rows, bounds.rows]),
            np.concatenate([self._third.columns, bounds.columns]),
            equalities,
        )

    def objective(self, x: Array) -> float:
        return 0.5 * self._scale * float(np.sum(self._third.values(x - self._wanted) ** 2))

    def inequalities(self, x: Array) -> Array:
        return self._bounds.values(x)

    def linearise(self, x: Array) -> Linearised:
        third = self._third.values(x - self._wanted)
        return _Linearised(self._bounds, self._third, self._scale, self._third.backward(self._scale * third))


class _Linearised:
    def __init__(self, bounds: AngleRows, third: LinearRows, scale: float, gradient: Array) -> None:
        self.gradient, self._bounds, self._third, self._scale = gradient, bounds, third, scale

    def forward(self, step: Array) -> Array:
        return self._bounds.forward(step)

    def backward(self, weights: Array) -> Array:
        return self._bounds.backward(weights)

    def hessian(self, weights: Array, multipliers: Array, exact: bool) -> Array:
        smooth = self._third.hessian(np.full(self._third.count, self._scale), multipliers, exact)
        return np.concatenate([smooth, self._bounds.hessian(weights, multipliers, exact)])
