"""The trajectory of a job with lines and arcs of the tool, or limits of its speed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.progress import Progress, part, stage
from armtempo.model import tool_segment
from armtempo.model.arm import Arm
from armtempo.model.job import AUTO, Job
from armtempo.model.leg import Search
from armtempo.model.parts import Limits
from armtempo.planning import checks, lower_bounds, time_parameterization
from armtempo.planning.fixed_path import Along, FixedPath, Optimum
from armtempo.planning.free.angle_bounds import of_path
from armtempo.planning.line import legs as cut
from armtempo.planning.line.deviation import LineDeviation
from armtempo.planning.line.follow import passed
from armtempo.planning.line.line_path import (
    DEGREE,
    DWELL_SEGMENTS,
    Led,
    LinePath,
    Proven,
    TimedPath,
    between,
    led_legs,
    proven_paths,
)
from armtempo.planning.line.tool_limits import ToolLimits, along, excess, reached
from armtempo.planning.lower_bounds import LowerBound
from armtempo.planning.through_plan import Planned
from armtempo.planning.tool import Tool
from armtempo.planning.variables import Index, time_points
from armtempo.splines import bspline, time_axis
from armtempo.splines.trajectory import JointSpline, Trajectory

_GAP, _PAYS = 1e-3, 1e-3
"""Relative gap of a time axis to its local optimum, and least relative saving of a finer axis."""
_REFINE_FACTOR = 8
_FINEST = 64
"""Most segments of a line that are tried where its tolerance needs fewer: with these a path is as good as the line."""
_TIMED = 128
"""Most segments of its time axis."""


def motion(arm: Arm, job: Job, via_deg: Array, progress: Progress) -> Planned:
    """The motion through via angles (n + 1, J) with the job's lines and arcs.

    Raises PlanError, naming via points and place, if the arm cannot follow, or the tolerance of the tool
    cannot be proven.
    """
    stage("following the tool's path")
    led = led_legs(arm, job, via_deg)
    others = {
        number: between(arm, job, leg, via_deg, progress)
        for number, leg in enumerate(cut.of_job(job))
        if not leg.tool_segments
    }
    finest = _FINEST if job.refine == AUTO else 0
    paths = proven_paths(arm, job, via_deg, {**led, **others}, finest)
    (path, away), best = _fastest(arm, job, paths, progress)
    checks.check_ranges(arm, path.angle_points_deg, DEGREE)
    notes = [_away(led[number], found) for number, found in away.items()]
    notes += [words for one in led.values() for words in passed(one.followed)]
    return _timed(arm, job, path, {number: one.bound for number, one in others.items()}, notes, best)


def _fastest(arm: Arm, job: Job, paths: Sequence[Proven], progress: Progress) -> tuple[Proven, _Axis]:
    """The path with the shortest time axis, and that axis, with at most ``_TIMED`` segments a line unless the job
    says otherwise: the same for the same path, whatever the tolerance."""
    limits = checks.limits_of(arm)
    dwells = DWELL_SEGMENTS * sum(stop.dwell_s > 0.0 for stop in job.stops)
    legs, found = cut.of_job(job), []
    for number, proven in enumerate(paths):
        path = proven.path
        moving = _moving(path)
        tool = Tool(arm, list(range(len(limits))), path.angle_points_deg[0])
        finest = max(
            ((path.knots[led + 1] - path.knots[led]) // len(legs[led].tool_segments) for led in proven.away),
            default=1,
        )
        most = time_parameterization.most_refine(job, path.knots[-1] + dwells, len(limits))
        levels = [job.refine] if isinstance(job.refine, int) else _levels(min(most, max(_TIMED // finest, 1)))
        own = [limits[joint] for joint in moving]
        watched = partial(_watched, path, tool, _tool_limits(job, path))
        points = path.angle_points_deg[:, moving]
        axis = _best_axis(points, own, levels, watched, part(progress, number, len(paths)) or progress)
        found.append((proven, axis))
    return min(found, key=lambda one: one[1].found.total_s)


def _moving(path: LinePath) -> Index:
    """The joints that move."""
    return np.flatnonzero(np.ptp(path.angle_points_deg, axis=0) > checks.TOLERANCE)


def _away(led: Led, found: LineDeviation) -> str:
    turned = f" and {found.rotation_deg:.2g} deg" if led.followed.course.fixed else ""
    return f"{led.leg.name}: the tool leaves its path by no more than {found.position_mm:.2g} mm{turned} (proven)"


def _timed(
    arm: Arm,
    job: Job,
    path: LinePath,
    bounds: Mapping[int, LowerBound | None],
    notes: list[str],
    best: _Axis,
) -> Planned:
    """The motion on the path with its time axis, slowed to the tool's limits as proven, and with its dwells."""
    limits = checks.limits_of(arm)
    moving = _moving(path)
    points, own = path.angle_points_deg[:, moving], [limits[joint] for joint in moving]
    tool = Tool(arm, list(range(len(limits))), path.angle_points_deg[0])
    tool_limits = _tool_limits(job, path)
    dwells_s = {stop.via: stop.dwell_s for stop in job.stops if stop.dwell_s > 0.0}
    found = best.found
    scale = max(1.0, time_parameterization.MIN_DURATION_S / found.total_s)
    if tool_limits.any:
        stage("proving the tool's limits")
        angles = of_path(bspline.refined(path.angle_points_deg, best.refine, DEGREE), DEGREE)
        axis = of_path(time_points(found.differences_s, DEGREE)[:, None], DEGREE)[:, :, 0]
        scale = max(scale, excess(angles, axis, tool, tool_limits.refined(best.refine)))
        notes += _limit_notes(job, path, angles, axis * scale, tool)
    timed = TimedPath(path.angle_points_deg, found.differences_s * scale, path.arrivals, best.refine)
    timed = timed.with_dwells(dwells_s)
    times = time_points(timed.differences_s, DEGREE)
    joints = tuple(
        JointSpline(DEGREE, best.refine, np.ascontiguousarray(column), times, timed.arrivals)
        for column in timed.angle_points_deg.T
    )
    waits_s = joints[0].duration_s - found.total_s * scale
    bound = _lower_bound(points, path.knots, own, found.total_s, bounds)
    search = Search(
        joints=tuple(map(int, moving)),
        intervals_s=timed.differences_s,
        total_s=joints[0].duration_s,
        searched_s=best.history_s[0] + waits_s,
        evaluations=len(best.history_s),
        history_s=np.minimum.accumulate(best.history_s) + waits_s,
        optimum_s=found.bound_s + waits_s,
        lower_bound_s=bound.time_s + sum(dwells_s.values()),
        lower_bound_kind=bound.kind,
    )
    return Planned(Trajectory(job.name, joints, True), (search,), tuple(notes))


class _Axis(NamedTuple):
    """The best of the tried time axes."""

    refine: int
    found: Optimum
    history_s: list[float]
    """Motion time of each tried axis."""


def _best_axis(
    points: Array, limits: Sequence[Limits], levels: Sequence[int], watched: Callable[[int], Along | None],
    progress: Progress,
) -> _Axis:  # fmt: skip
    """The shortest axis, refined as long as that saves time; ``watched``: further quantities with limits."""
    differences, before = np.ones(len(points) - 1), 1
    tried: list[tuple[int, Optimum]] = []
    for refine in levels:
        stage(f"refining to {refine}")
        axis = FixedPath(points, DEGREE, limits, refine, along=watched(refine))
        found = axis.optimum(time_axis.cut(differences, before, refine, DEGREE), _GAP)
        tried.append((refine, found))
        progress(len(tried), len(levels))
        if found.total_s >= min((one.total_s for _, one in tried[:-1]), default=np.inf) * (1.0 - _PAYS):
            break
        differences, before = found.differences_s, refine
    best = min(tried, key=lambda one: one[1].total_s)
    return _Axis(*best, [found.total_s for _, found in tried])


def _watched(path: LinePath, tool: Tool, limits: ToolLimits, refine: int) -> Along | None:
    """The tool's distance as a quantity with limits; None without limits."""
    if not limits.any:
        return None
    pieces = bspline.subdivide(bspline.polynomials(path.angle_points_deg, DEGREE), refine)
    return along(pieces, tool, limits.refined(refine))


def _levels(most: int) -> list[int]:
    """Refinements to try, each only if the one before saved enough."""
    return [1, min(_REFINE_FACTOR, most)][: min(most, 2)]


def _lower_bound(
    points: Array,
    knots: Sequence[int],
    limits: Sequence[Limits],
    about_s: float,
    bounds: Mapping[int, LowerBound | None],
) -> LowerBound:
    """Lower bound for all time laws on the path with rests between legs; ``bounds``: known bounds of
    legs."""
    parts = []
    for number, (first, last) in enumerate(pairwise(knots)):
        leg = points[first : last + DEGREE]
        moving = np.ptp(leg, axis=0) > checks.TOLERANCE
        own = [limit for limit, moves in zip(limits, moving, strict=True) if moves]
        share = about_s * (last - first) / knots[-1]
        parts.append(bounds.get(number) or lower_bounds.of_path(leg[:, moving], DEGREE, own, share))
    return LowerBound(sum(part.time_s for part in parts), parts[0].kind)


def _asked(job: Job, via: int) -> tuple[float, float]:
    """Limits of the tool's speed and acceleration on the path to a via point; infinite without a limit."""
    segment = tool_segment.at(job.tool_segments, via)
    both = []
    for key in ("speed_mm_s", "acceleration_mm_s2"):
        own = getattr(segment, key) if segment else None
        asked = own if own is not None else getattr(job, key)
        both.append(np.inf if asked is None else asked)
    return both[0], both[1]


def _tool_limits(job: Job, path: LinePath) -> ToolLimits:
    """The tool's limits on each segment; segments of a cut corner have those of both lines."""
    segments = path.knots[-1]
    limits = np.full((2, segments), np.inf)
    for via, (first, last) in enumerate(pairwise(path.arrivals), 1):
        from_rest, to_rest = first in path.knots, last in path.knots
        own = slice(first if from_rest else first - 1, last if to_rest else last + 1)
        limits[:, own] = np.minimum(limits[:, own], np.array(_asked(job, via))[:, None])
    return ToolLimits(*limits)


def _limit_notes(job: Job, path: LinePath, angles: Array, axis_s: Array, tool: Tool) -> list[str]:
    """Notes: proven maxima of the tool on each path with a limit.

    From Bernstein coefficients of angles (S, 6, J) and time (S, 6).
    """
    refine = len(angles) // path.knots[-1]
    notes = []
    for via, (first, last) in enumerate(pairwise(path.arrivals), 1):
        asked = _asked(job, via)
        if not np.any(np.isfinite(asked)):
            continue
        own = slice(first * refine, last * refine)
        found = reached(angles[own], axis_s[own], tool)
        words = [
            f"{value:.4g} {unit}"
            for value, limit, unit in zip(found, asked, ("mm/s", "mm/s²"), strict=True)
            if np.isfinite(limit)
        ]
        notes.append(f"P{via - 1} to P{via}: the tool moves at no more than {' and '.join(words)} (proven)")
    return notes
