"""A motion with a free path between the via points, and the optimisation of its time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import comb
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from armtempo.basics.arrays import Array
from armtempo.basics.errors import PlanError
from armtempo.optimise import interior_point, slack_method
from armtempo.optimise.interior_point import Kkt, Schedule
from armtempo.optimise.kkt import BandedKkt, Equalities
from armtempo.optimise.slack_method import Goal
from armtempo.planning import collocation
from armtempo.planning.collocation import Curve, Points, Ratios
from armtempo.planning.free import angle_bounds
from armtempo.planning.free.angle_bounds import AngleRows
from armtempo.planning.free.layout import DEGREE, DWELL_SEGMENTS, Layout, Vias
from armtempo.planning.free.tool_rows import ToolRows, ToolTargets
from armtempo.planning.limit_rows import LimitRows
from armtempo.planning.motion_program import Block, MotionProgram, mean_slopes, time_weights
from armtempo.planning.tool import Tool
from armtempo.planning.variables import MotionVariables, time_points
from armtempo.splines import bspline

_PARTS, _COARSE_PARTS = (1, 2, 4), (4, 4, 4)
"""Points per segment at which speed, acceleration and jerk are kept besides peaks: on many segments, and on few."""
_FINE = 16
"""Segments per via point that are many."""
_CORRIDOR_PARTS = 4
"""Points per segment at which the tool's corridor is enforced."""
_PEAK_PARTS = 16
"""Points per segment on which peaks are looked for."""
_PEAK_THRESHOLDS = 0.95, 0.99
"""Peaks that become points after the first solve, and after a later one."""
_TIGHTENED = 2
"""After so many solves peaks not only become points: next to them the limit is lowered too, until they keep it."""
_AWAY, _LEAST_AWAY = 0.01, 1e-5
"""Fraction by which time is scaled before each solve, for a start within the limits: twice what the last one was
scaled by, within these."""
_SMOOTHING, _SMOOTHED = 0.075, 0.1
"""Weight of steps between time differences in the first solve, per segment and via point; fraction of it later."""
_LEAST_STEP = 1e-3
"""Least difference of time control points, as a fraction of their mean: rounding errors of angles are divided
by its cube."""
_COARSE, _FIRST = Goal(gap=5e-3, violation=1e-3), Goal(gap=2e-3, violation=1e-3)
_AGAIN = Goal(gap=3e-4, violation=1e-4, first_gap=1e-2, least_slack=2e-3)
"""Goals of the first solve, on few segments and on many, whose peaks are added to the points, and of the later ones,
which start from its result."""
_GAP_PART, _MOST_GAP = 0.3, 1e-3
_VIOLATION_PART, _MOST_VIOLATION = 0.1, 3e-4
"""A later solve is no more exact than these parts of the excess of the one before: its peaks will move."""
_TOOL_KEPT = 0.9995
"""Fraction of the tool's tolerances that a solve may use: it meets them to about half of the rest."""
_ROUNDED = 1e-10
"""Relative excess over a bound that is only rounding."""
_PART_OUT = 0.9
"""How far a motion beyond a bound is moved towards the bound, as seen from one within: a solve starts inside."""
_PARTS_KEPT = (1.0, 0.999, 0.99, 0.9, 0.5)
"""The same for one that exceeds a tolerance of the tool, until it keeps them."""
_AT_END = 1e-6
"""A via point this close to the end of a range (fraction of the joint's motion) counts as at the end."""
_WORSE = 1.1
"""After a solve with so many times the time of the best motion, the limits are kept by all iterates from there on."""
_CAREFUL = Schedule(first_barrier=0.1, last_barrier=1e-3, iterations=40, curvature=False)
_NEARBY = 0.5
"""Solves leave out the ends of ranges that are farther from the motion than this fraction of the joint's motion."""
_NEAR = 1e-4
"""Solves end if the limits at their points are exceeded by at most this fraction."""


class Tolerance(NamedTuple):
    """Largest distance of the tool from a pose."""

    position_mm: float
    rotation_deg: float


@dataclass(frozen=True, eq=False)
class Demand:
    """Requirements for a free motion of J joints through n + 1 via points."""

    names: tuple[str, ...]
    """Names of the joints."""
    via_deg: Array
    """(n + 1, J)."""
    limits: Array
    """Speed, acceleration, jerk: (J, 3)."""
    low_deg: Array
    high_deg: Array
    """Ranges of the joints: (J,)."""
    stops: Mapping[int, float]
    """Dwell in seconds by via point where the motion rests, 0 for a rest without one."""
    corridor_deg: float = np.inf
    """Largest distance of any joint from the spline through the via points."""
    corridor_mm: float = np.inf
    """Largest distance of the tool from that spline."""
    tool: Tool | None = None
    """The tool for these joints; needed for ``corridor_mm`` and ``tolerances``."""
    tolerances: Mapping[int, Tolerance] = field(default_factory=dict)
    """Tolerances of the tool, by via point."""

    @property
    def size_deg(self) -> Array:
        """Span of the via points of each joint: (J,)."""
        return np.asarray(np.ptp(self.via_deg, axis=0))

    @property
    def margin_deg(self) -> Array:
        """Distance of each via point from the nearer end of its joint's range: (n + 1, J)."""
        return np.minimum(self.via_deg - self.low_deg, self.high_deg - self.via_deg)

    @property
    def turning(self) -> NDArray[np.bool_]:
        """Via points at the end of a joint's range, where the joint must turn: (n + 1, J)."""
        return np.asarray(self.margin_deg <= _AT_END * self.size_deg)


@dataclass(frozen=True, eq=False)
class FreeMotion:
    """Control points of the angles (S + 5, J) in degrees, and differences (S + 4,) of those of time in seconds."""

    layout: Layout
    angle_points_deg: Array
    differences_s: Array

    def curve(self, limits: Array) -> Curve:
        """The motion by its polynomials."""
        angle = np.moveaxis(bspline.polynomials(self.angle_points_deg, DEGREE), 2, 0)
        time = bspline.polynomials(time_points(self.differences_s, DEGREE), DEGREE)
        return Curve(np.ascontiguousarray(angle), time, limits)

    @property
    def total_s(self) -> float:
        """Motion time."""
        return float(time_weights(self.variables) @ self.differences_s)

    @property
    def variables(self) -> MotionVariables:
        """The layout of its variables."""
        return MotionVariables(self.layout.segments, DEGREE, self.angle_points_deg.shape[1])

    @property
    def via_times_s(self) -> Array:
        """Arrival times at the via points: (n + 1,)."""
        times = bspline.polynomials(time_points(self.differences_s, DEGREE), DEGREE)
        return np.append(times[self.layout.arrivals[:-1], 0], times[-1].sum())

    @property
    def leg_times_s(self) -> Array:
        """Time from each via point to the next, without dwells: (n,)."""
        dwells = [self.layout.stops.get(via, 0.0) for via in range(len(self.layout.pieces))]
        return np.asarray(np.diff(self.via_times_s) - np.array(dwells))

    def scaled(self, limits: Array) -> FreeMotion:
        """The motion with time scaled so that it just keeps every limit, proven."""
        return self.slower(self.curve(limits).scale())

    def slower(self, factor: float) -> FreeMotion:
        """The motion with time scaled, except in dwells: the difference that acts only on a dwell compensates.

        If it would be negative, the dwell lasts longer.
        """
        differences = self.differences_s * factor
        weights = np.convolve(np.ones(DWELL_SEGMENTS), mean_slopes(DEGREE))
        for knot, dwell_s in self.layout.dwells.items():
            own = knot + DEGREE - 1
            lasts_s = float(weights @ differences[knot : knot + len(weights)])
            differences[own] = max(differences[own] + dwell_s - lasts_s, _LEAST_STEP * dwell_s)
        return replace(self, differences_s=differences)


def bounds(demand: Demand, layout: Layout) -> tuple[Array, Array]:
    """Lowest and highest Bernstein coefficients that ranges and corridor allow: two arrays (S, 6, J)."""
    shape = (layout.segments, DEGREE + 1, len(demand.low_deg))
    low, high = np.broadcast_to(demand.low_deg, shape), np.broadcast_to(demand.high_deg, shape)
    if np.isfinite(demand.corridor_deg):
        middle = through(demand, layout)
        low = np.maximum(low, middle - demand.corridor_deg)
        high = np.minimum(high, middle + demand.corridor_deg)
    held = _held(demand, layout)
    return np.where(held, -np.inf, low), np.where(held, np.inf, high)


def _held(demand: Demand, layout: Layout) -> NDArray[np.bool_]:
    """Bernstein coefficients (S, 6, J) that are fixed by a via point at the end of a range."""
    held = np.zeros((layout.segments, DEGREE + 1, demand.via_deg.shape[1]), dtype=bool)
    last = len(layout.pieces)
    for via, (arrives, leaves) in enumerate(zip(layout.arrivals, layout.departures(), strict=True)):
        same = 3 if via in (0, last) or via in layout.stops else 2
        joints = demand.turning[via]
        held[max(arrives - 1, 0) : arrives, DEGREE + 1 - same :, joints] = True
        held[arrives:leaves, :, joints] = True
        held[leaves : leaves + 1, :same, joints] = True
    return held


def through(demand: Demand, layout: Layout) -> Array:
    """Bernstein coefficients (S, 6, J) of the spline through the via points, at rest in dwells."""
    points = bspline.fit(demand.via_deg, DEGREE)
    pieces = bspline.polynomials(points, DEGREE)
    parts = [_bernstein(piece[None], int(count)) for piece, count in zip(pieces, layout.pieces, strict=True)]
    whole = []
    for via, part in enumerate(parts):
        if layout.stops.get(via, 0.0) > 0.0:
            rest = (DWELL_SEGMENTS, DEGREE + 1, points.shape[1])
            whole.append(np.broadcast_to(demand.via_deg[via], rest))
        whole.append(part)
    return np.concatenate(whole)


def _targets(demand: Demand, layout: Layout) -> ToolTargets | None:
    """Targets for the tool: via points with a tolerance, and points along a corridor."""
    if demand.tool is None:
        return None
    parts = []
    if demand.tolerances:
        vias = sorted(demand.tolerances)
        allowed = np.array([demand.tolerances[via] for via in vias])
        knots = layout.arrivals[vias]
        segment = np.minimum(knots, layout.segments - 1)
        state = demand.tool.at(demand.via_deg[vias])
        points = Points(segment, (knots - segment).astype(float))
        parts.append(ToolTargets(points, state.position_mm, state.rotation, *allowed.T))
    if np.isfinite(demand.corridor_mm):
        points = collocation.grid(layout.segments, _CORRIDOR_PARTS, ends=False)
        inner = Points(points.segment[1:-1], points.u[1:-1])
        state = demand.tool.at(_at(through(demand, layout), inner))
        most = np.full(len(inner.u), demand.corridor_mm)
        parts.append(ToolTargets(inner, state.position_mm, state.rotation, most, np.full(len(most), np.inf)))
    return sum(parts[1:], parts[0]) if parts else None


def _at(pieces: Array, points: Points) -> Array:
    """Values (P, J) of Bernstein coefficients (S, 6, J) at points."""
    count = np.arange(DEGREE + 1)
    u = points.u[:, None]
    weights = np.array([comb(DEGREE, index) for index in count]) * u**count * (1.0 - u) ** (DEGREE - count)
    return np.asarray(np.einsum("pb,pbj->pj", weights, pieces[points.segment]))


def _bernstein(piece: Array, parts: int) -> Array:
    """Bernstein coefficients (parts, 6, J) of one segment, power coefficients (1, 6, J), cut into parts."""
    from armtempo.splines import bernstein

    cut = np.moveaxis(bspline.subdivide(piece, parts), 1, 2)
    return np.moveaxis(bernstein.unscale(bernstein.from_power(cut)), 2, 1)


class Improver:
    """Improves a feasible motion by solving programs; the results are feasible too."""

    def __init__(self, demand: Demand, layout: Layout) -> None:
        self.demand, self.layout = demand, layout
        self.variables = MotionVariables(layout.segments, DEGREE, len(demand.limits))
        self._size = demand.size_deg
        self._low, self._high = bounds(demand, layout)
        self._targets = _targets(demand, layout)
        self._kkt: Kkt | None = None
        self._fine = layout.segments >= _FINE * (len(demand.via_deg) - 1)

    def improved(self, motion: FreeMotion, rounds: int) -> FreeMotion:
        """The motion after ``rounds`` solves, each with the peaks of the previous one; never slower than
        ``motion``."""
        parts = _PARTS if self._fine else _COARSE_PARTS
        at = Ratios.grid(self.layout.segments, len(self._size), parts)
        best = here = motion.scaled(self.demand.limits)
        scale, known = np.inf, np.empty((2, 0))
        number, careful = 0, False
        for _ in range(rounds + 1):
            known = np.concatenate([known, np.full((2, len(at.kind) - known.shape[1]), np.nan)], axis=1)
            goal = self._goal(scale - 1.0, number + 1 == rounds)
            solved, known = self._solve(here, at, scale, known, goal, careful)
            here = self._inside(solved, best)
            curve = here.curve(self.demand.limits)
            scale = curve.scale()
            least = _PEAK_THRESHOLDS[min(number, 1)]
            peaks = collocation.peaks(curve, _PEAK_PARTS, least)
            if number >= _TIGHTENED:
                at = at.tightened(curve, peaks)
            at += peaks
            here = here.slower(scale)
            if here.total_s > _WORSE * best.total_s and not careful:  # it ended far beyond the limits
                here, scale, known, careful = best, np.inf, np.full_like(known, np.nan), True
                continue
            best = min(best, here, key=lambda candidate: candidate.total_s)
            number += 1
            if (scale < 1.0 + _NEAR and goal.gap <= _AGAIN.gap) or number == rounds:
                break
        return best

    def _inside(self, motion: FreeMotion, within: FreeMotion) -> FreeMotion:
        """The motion, moved towards ``within`` if it exceeds a tolerance of the tool, or the exact via points have
        moved it out of the bounds."""
        found, safe = (self._beyond(each) for each in (motion, within))
        out = found > _ROUNDED
        part = 1.0
        if out.any():
            part = _PART_OUT * float(np.min((_ROUNDED - safe[out]) / (found[out] - safe[out])))
        change = motion.angle_points_deg - within.angle_points_deg
        for less in _PARTS_KEPT if self._targets is not None else (1.0,):
            near = motion
            if less * part < 1.0:
                near = replace(motion, angle_points_deg=within.angle_points_deg + less * part * change)
            if part > 0.0 and not self._strays(near):
                return near
        return within

    def _strays(self, motion: FreeMotion) -> bool:
        """Whether the tool exceeds a tolerance at a point."""
        rows = self._tool_rows(1.0)
        x = self.variables.pack(motion.angle_points_deg / self._size, motion.differences_s)
        return rows is not None and bool(np.any(rows.values(x) < 0.0))

    def _tool_rows(self, part: float) -> ToolRows | None:
        """Inequalities of the tool, with this part of its tolerances; None without targets."""
        if self._targets is None or self.demand.tool is None:
            return None
        return ToolRows(self.variables, self.demand.tool, self._targets.narrowed(part), self._size)

    def _beyond(self, motion: FreeMotion) -> Array:
        """Excess of each Bernstein coefficient over its bounds, relative to the largest angle: (S, 6, J)."""
        at = angle_bounds.of_path(motion.angle_points_deg, DEGREE)
        largest = np.maximum(1.0, np.maximum(np.abs(self.demand.low_deg), np.abs(self.demand.high_deg)))
        return np.asarray(np.maximum(self._low - at, at - self._high) / largest)

    def equalities(self, unit_s: float) -> Equalities:
        """Equalities, with angles in units of ``size_deg`` and times in ``unit_s``."""
        via = Vias(self.demand.via_deg / self._size, self.demand.turning, frozenset(self.demand.tolerances))
        return self.layout.equalities(self.variables, via, unit_s)

    def angle_rows(self, motion: FreeMotion) -> Block:
        """Inequalities of ranges and corridor near the motion, with angles in units of ``size_deg``."""
        at, near = angle_bounds.of_path(motion.angle_points_deg, DEGREE), _NEARBY * self._size
        low = np.where(at - near < self._low, self._low, -np.inf)
        high = np.where(at + near > self._high, self._high, np.inf)
        return AngleRows(self.variables.size, low / self._size, high / self._size)

    def _solve(
        self, motion: FreeMotion, at: Ratios, scale: float, known: Array, goal: Goal, careful: bool
    ) -> tuple[FreeMotion, Array]:
        """The motion that keeps R ratios within their limits, and the multipliers of these, (2, R).

        ``known``: multipliers of the solve before, NaN of new ratios; ``scale``: how much it exceeded the limits, as
        a factor on time, inf for the first; ``careful``: all iterates keep the limits, if the start does.
        """
        unit_s = motion.total_s / self.layout.segments
        limits = self.demand.limits * unit_s ** np.arange(1, 4) / self._size[:, None]
        first, excess = scale == np.inf, scale - 1.0
        smoothing = self._smoothing() * (1.0 if first else _SMOOTHED)
        steps = motion.differences_s / unit_s * (1.0 + min(2.0 * excess + _LEAST_AWAY, _AWAY))
        least = min(_LEAST_STEP, 0.5 * float(steps.min()))
        start = self.variables.pack(motion.angle_points_deg / self._size, steps)
        limit_rows = LimitRows(self.variables, at, limits)
        blocks: list[Block] = [limit_rows, self.angle_rows(motion)]
        if (tool_rows := self._tool_rows(_TOOL_KEPT)) is not None:
            blocks.append(tool_rows)
        program = MotionProgram(self.variables, blocks, self.equalities(unit_s), smoothing, least, self._kkt)
        self._kkt = program.kkt
        multipliers = np.full(len(program.linear), np.nan)
        multipliers[: known.size] = known[:, limit_rows.order].ravel()
        if careful:
            x = interior_point.minimise(program, start, _CAREFUL).x
        else:
            x, multipliers = slack_method.minimise(program, start, program.linear, goal, multipliers)
        x = met(self.variables, program.equalities, x)
        solved = replace(
            motion,
            angle_points_deg=self.variables.angle_points(x) * self._size,
            # a dwell much shorter than the segments next to it may be missed; then it lasts longer
            differences_s=np.maximum(self.variables.time_differences(x), least) * unit_s,
        )
        found = np.empty_like(known)
        found[:, limit_rows.order] = multipliers[: known.size].reshape(2, -1)
        return solved, found

    def _goal(self, excess: float, last: bool) -> Goal:
        """Of a solve, by how much the one before exceeded the limits, inf for the first, and whether it is the last."""
        if excess == np.inf:
            return _FIRST if self._fine else _COARSE
        if last:
            return _AGAIN
        return replace(
            _AGAIN,
            gap=min(max(_AGAIN.gap, _GAP_PART * excess), _MOST_GAP),
            violation=min(max(_AGAIN.violation, _VIOLATION_PART * excess), _MOST_VIOLATION),
        )

    def _smoothing(self) -> Array:
        """Weights of the steps between time differences; none where a dwell begins and ends."""
        vias = len(self.demand.via_deg) - 1
        weights = np.full(self.variables.differences - 1, _SMOOTHING * self.layout.segments / vias**2)
        for knot in self.layout.dwells:
            weights[knot + DWELL_SEGMENTS - 2 : knot + DWELL_SEGMENTS] = 0.0
        return weights


def met(variables: MotionVariables, equalities: Equalities, x: Array, smooth: bool = False) -> Array:
    """``x`` changed so that the equalities hold, minimising the third differences of the change.

    With ``smooth``, minimising the third differences of the angles themselves. Raises PlanError if the
    equalities contradict each other.
    """
    control = np.concatenate([variables.angle_index(joint) for joint in range(variables.joints)])
    starts = np.concatenate([variables.angle_index(joint)[:-3] for joint in range(variables.joints)])
    window = starts[:, None] + np.arange(4)
    third = np.array([-1.0, 3.0, -3.0, 1.0])
    rows = np.concatenate([np.repeat(window, 4, axis=1).ravel(), np.arange(variables.size)])
    columns = np.concatenate([np.tile(window, (1, 4)).ravel(), np.arange(variables.size)])
    steady = np.ones(variables.size)
    steady[control] = 1e-9
    entries = np.concatenate([np.tile(np.outer(third, third).ravel(), len(window)), steady])
    gradient = np.zeros(variables.size)
    if smooth:
        bent = x[window] @ third
        np.add.at(gradient, window, np.outer(bent, third))
    # nothing couples the joints: one after the other, the band is as narrow as that of one
    apart = (variables.angles + 1.0) * (np.arange(variables.size) // variables.angles)
    firsts = equalities.column[np.searchsorted(equalities.row, np.arange(equalities.count))]
    placed = replace(equalities, places=equalities.places + apart[firsts])
    kkt = BandedKkt(variables.places + apart, rows, columns, placed)
    try:
        factor = kkt.factor(entries)
    except np.linalg.LinAlgError:
        raise PlanError(
            "no motion was found that meets all via points, rests and dwells",
            "raise refine, or set it to 'auto'; or use times and angles of more similar magnitude",
        ) from None
    return x + factor.solve(gradient, equalities.residual(x))
