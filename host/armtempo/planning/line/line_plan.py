"""The trajectory of a job that leads the tool along lines and arcs, or limits its speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from armtempo_shared.limits import MAX_SEGMENTS

from armtempo.basics.arrays import Array
from armtempo.basics.errors import PlanError
from armtempo.basics.progress import Progress, stage
from armtempo.model import tool_way
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.parts import Limits
from armtempo.model.plan import Search
from armtempo.planning import checks, lower_bounds, time_parameterization
from armtempo.planning.fixed_path import FixedPath
from armtempo.planning.free.angle_bounds import of_path
from armtempo.planning.line import runs as cut
from armtempo.planning.line.deviation import Deviation, proven
from armtempo.planning.line.follow import Followed, follow
from armtempo.planning.line.runs import Run
from armtempo.planning.line.tool_limits import ToolLimits, along, excess, reached
from armtempo.planning.lower_bounds import Floor
from armtempo.planning.planned import Planned
from armtempo.planning.tool import Tool
from armtempo.planning.variables import time_points
from armtempo.splines import bspline, time_axis
from armtempo.splines.trajectory import JointSpline, Trajectory

DEGREE = 5
_LEAST_PIECES, _THROUGH_PIECES = 8, 8
"""Segments of a line at first, and of the spline between two via points."""
_SAME_DEG = 1e-4
"""Two postures as near as this are one."""
_FLOOR = 0.2
"""Least speed of the way in u, as a part of its mean."""
_SMOOTH = 0.05
"""The speed of the way is smoothed over this part of it."""
_CORNER = 2.5
"""Least slowness of the way where a corner is cut, as a part of its mean."""
_TABLE = 512
_GAP, _PAYS = 1e-3, 1e-3
"""How near to its local optimum a time axis comes, and what a finer one has to save."""
_REFINE_FACTOR = 8


@dataclass(frozen=True, eq=False)
class _Led:
    """A run with the postures along its way."""

    run: Run
    followed: Followed
    density: Array
    """How the places of its knots are shared out: places (_TABLE + 1,) in [0, 1] at equal steps of u."""


@dataclass(frozen=True, eq=False)
class _Path:
    """The joints' spline of all runs."""

    angle_points_deg: Array
    way_points: Array
    """Of the ways of all runs one after the other, as a spline of the same knots."""
    knots: tuple[int, ...]
    """Segments before each run, and all."""
    arrivals: tuple[int, ...]
    """Segments before each via point."""


def motion(arm: Arm, job: Job, via_deg: Array, progress: Progress) -> Planned:
    """The motion through via angles (n + 1, J), the tool led as the job asks.

    Raises PlanError, naming via points and place, where the arm cannot follow, or the tool is not proven to stay near
    its way.
    """
    stage("following the tool's way")
    led = [_follow(arm, job, run, via_deg) if run.ways else run for run in cut.of_job(job)]
    path, notes = _proven(arm, job, led, via_deg)
    checks.check_ranges(arm, path.angle_points_deg, DEGREE)
    return _timed(arm, job, path, notes, progress)


def _follow(arm: Arm, job: Job, run: Run, via_deg: Array) -> _Led:
    found = follow(cut.course(arm, job, run, via_deg[run.first]), via_deg[run.first])
    off = found.end_deg - via_deg[run.last]
    worst = int(np.argmax(np.abs(off)))
    if abs(off[worst]) > _SAME_DEG:
        raise PlanError(
            f"{run.name}: along the line the arm comes to P{run.last} with {arm.driven[worst].name} at "
            f"{found.end_deg[worst]:.4g} degrees, not {via_deg[run.last, worst]:.4g}: it would have to change its "
            "branch on the way",
            f"give P{run.last} as a pose, or the angles of the branch of P{run.first}; or leave line out",
        )
    limits = np.array([limit.speed_deg_s for limit in checks.limits_of(arm)])
    return _Led(run, found, _density(found, limits))


def _density(found: Followed, speeds: Array) -> Array:
    """Places on the way at equal steps of u: slow at both ends, and where the joints have far to turn."""
    u = np.linspace(0.0, 1.0, _TABLE + 1)
    places = found.ways / found.ways[-1]
    taken = np.abs(np.diff(found.angles_deg, axis=0) / speeds).max(axis=1) / np.diff(places)
    slow = np.interp(u, 0.5 * (places[1:] + places[:-1]), taken)
    slow = np.maximum(slow, _FLOOR * slow.mean())
    path = found.course.path
    for place, cut_mm in zip(path.starts[1:-1], path.cuts, strict=True):
        if cut_mm > 0.0:  # as many segments there as on a line so much longer
            near = np.abs(u * path.length - place) < cut_mm
            slow[near] = np.maximum(slow[near], _CORNER * slow.mean())
    reach = int(3 * _SMOOTH * _TABLE)
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / (_SMOOTH * _TABLE)) ** 2)
    slow = np.convolve(np.pad(slow, reach, mode="reflect"), kernel / kernel.sum(), mode="valid")
    done = np.concatenate([[0.0], np.cumsum(0.5 * (slow[1:] + slow[:-1]))])
    eased = u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
    return np.asarray(np.interp(eased, done / done[-1], u))


def _proven(
    arm: Arm, job: Job, led: Sequence[_Led | Run], via_deg: Array
) -> tuple[_Path, list[str]]:
    """The spline with as many segments as it takes until the tool is proven to stay near its way."""
    pieces = [_LEAST_PIECES if isinstance(one, _Led) else _through(one) for one in led]
    while True:
        path = _path(led, pieces, via_deg)
        found = [
            _deviation(one, path, number) if isinstance(one, _Led) else None for number, one in enumerate(led)
        ]
        wide = [
            number
            for number, (one, away) in enumerate(zip(led, found, strict=True))
            if away and (away.position_mm > one.run.enough.position_mm or away.rotation_deg > one.run.enough.rotation_deg)
        ]
        if not wide:
            break
        for number in wide:
            pieces[number] *= 2
        if sum(pieces) > MAX_SEGMENTS:
            one, away = led[wide[0]], found[wide[0]]
            raise PlanError(
                f"{one.run.name}: the tool is only proven to stay within {away.position_mm:.3g} mm and "
                f"{away.rotation_deg:.3g} deg of its way with {pieces[wide[0]] // 2} segments, and the board holds "
                f"{MAX_SEGMENTS} in all",
                "widen tolerance_mm and tolerance_deg, keep away from singular postures, or split the job",
            )
    return path, [
        f"{one.run.name}: the tool leaves its way by no more than {away.position_mm:.2g} mm"
        + (f" and {away.rotation_deg:.2g} deg" if one.followed.course.fixed else "")
        + " (proven)"
        for one, away in zip(led, found, strict=True)
        if away
    ]


def _through(run: Run) -> int:
    return _THROUGH_PIECES * (run.last - run.first)


def _path(led: Sequence[_Led | Run], pieces: Sequence[int], via_deg: Array) -> _Path:
    """The spline through postures of all runs, with a rest between each two."""
    angles, ways = [], []
    arrivals, knots, before = [0], [0], 0.0
    for one, count in zip(led, pieces, strict=True):
        if isinstance(one, _Led):
            steps = np.linspace(0.0, 1.0, count + 1)
            own = np.interp(steps, np.linspace(0.0, 1.0, _TABLE + 1), one.density) * one.followed.course.path.length
            angles.append(one.followed.at(own))
            arrivals += [knots[-1] + int(k) for k in _passed(one, own)]
        else:
            points = bspline.fit(via_deg[one.first : one.last + 1], DEGREE)
            fine = bspline.polynomials(bspline.refined(points, _THROUGH_PIECES, DEGREE), DEGREE)
            angles.append(np.concatenate([fine[:, 0], fine[-1:].sum(axis=1)]))
            own = np.linspace(0.0, 1.0, count + 1)
            arrivals += [knots[-1] + _THROUGH_PIECES * via for via in range(1, one.last - one.first + 1)]
        ways.append(before + own)
        before += own[-1]
        knots.append(knots[-1] + count)
    knot_deg = np.concatenate([one[:-1] for one in angles[:-1]] + [angles[-1]])
    knot_way = np.concatenate([one[:-1] for one in ways[:-1]] + [ways[-1]])
    whole = bspline.fit(np.column_stack([knot_deg, knot_way]), DEGREE, knots[1:-1])
    return _Path(whole[:, :-1], whole[:, -1], tuple(knots), tuple(arrivals))


def _passed(one: _Led, ways: Array) -> Array:
    """The knots of a run nearest to each of its via points but the first, increasing."""
    starts = one.followed.course.path.starts[1:]
    return np.array([int(np.argmin(np.abs(ways - start))) for start in starts])


def _deviation(one: _Led, path: _Path, number: int) -> Deviation:
    first, last = path.knots[number], path.knots[number + 1]
    angles = of_path(path.angle_points_deg, DEGREE)[first:last]
    ways = of_path(path.way_points[:, None], DEGREE)[first:last, :, 0]
    begin = float(ways[0, 0])
    course = one.followed.course
    return proven(angles, ways - begin, one.followed.tool, course.path, course.fixed, one.run.enough)


def _timed(arm: Arm, job: Job, path: _Path, notes: list[str], progress: Progress) -> Planned:
    """The shortest time axis on the path."""
    limits = checks.limits_of(arm)
    segments = path.knots[-1]
    moving = [int(joint) for joint in np.flatnonzero(np.ptp(path.angle_points_deg, axis=0) > checks.TOLERANCE)]
    points, own = path.angle_points_deg[:, moving], [limits[joint] for joint in moving]
    most = time_parameterization.most_refine(job, segments, len(limits))
    tool = Tool(arm, list(range(len(limits))), path.angle_points_deg[0])
    tool_limits = _tool_limits(job, path)
    pieces = bspline.polynomials(path.angle_points_deg, DEGREE)
    levels = [job.refine] if isinstance(job.refine, int) else _levels(most)
    differences, before, best = np.ones(segments + DEGREE - 1), 1, None
    history = []
    for number, refine in enumerate(levels):
        stage(f"refining to {refine}")
        watched = None
        if tool_limits.any:
            fine = bspline.subdivide(pieces, refine)
            watched = along(fine, tool, tool_limits.refined(refine))
        axis = FixedPath(points, DEGREE, own, refine, along=watched)
        found = axis.optimum(time_axis.cut(differences, before, refine, DEGREE), _GAP)
        history.append(found.total_s)
        pays = best is None or found.total_s < best[1].total_s * (1.0 - _PAYS)
        if best is None or found.total_s < best[1].total_s:
            best = (refine, found)
        differences, before = found.differences_s, refine
        progress(number + 1, len(levels))
        if not pays:
            break
    assert best is not None
    refine, found = best
    stretch = max(1.0, time_parameterization.MIN_DURATION_S / found.total_s)
    if tool_limits.any:
        stage("proving the tool's limits")
        curve = _bernstein(path.angle_points_deg, refine), of_path(time_points(found.differences_s, DEGREE)[:, None], DEGREE)
        over = excess(curve[0], curve[1][:, :, 0], tool, tool_limits.refined(refine))
        stretch = max(stretch, over)
    times = time_points(found.differences_s * stretch, DEGREE)
    joints = tuple(
        JointSpline(DEGREE, refine, np.ascontiguousarray(column), times, path.arrivals)
        for column in path.angle_points_deg.T
    )
    floor = _floor(points, path.knots, own, found.total_s)
    search = Search(
        joints=tuple(moving),
        intervals_s=found.differences_s,
        total_s=found.total_s * stretch,
        searched_s=history[0],
        evaluations=len(history),
        history_s=np.minimum.accumulate(history),
        optimum_s=found.bound_s,
        floor_s=floor.time_s,
        floor_kind=floor.kind,
    )
    notes += _limit_notes(job, path, refine, times, tool)
    return Planned(Trajectory(job.name, joints, True), (search,), tuple(notes))


def _levels(most: int) -> list[int]:
    """Refinements to go through, each only where the one before saved enough."""
    return [1, min(_REFINE_FACTOR, most)][: min(most, 2)]


def _floor(points: Array, knots: Sequence[int], limits: Sequence[Limits], about_s: float) -> Floor:
    """No time law along the path that rests between its runs takes less."""
    parts = []
    for first, last in pairwise(knots):
        run = points[first : last + DEGREE]
        moving = np.ptp(run, axis=0) > checks.TOLERANCE
        own = [limit for limit, moves in zip(limits, moving, strict=True) if moves]
        share = about_s * (last - first) / knots[-1]
        parts.append(lower_bounds.of_path(run[:, moving], DEGREE, own, share))
    return Floor(sum(part.time_s for part in parts), parts[0].kind)


def _bernstein(points: Array, parts: int) -> Array:
    """Bernstein coefficients of control points (S + 5, J) with each segment cut: (S * parts, 6, J)."""
    return of_path(bspline.refined(points, parts, DEGREE), DEGREE)


def _asked(job: Job, via: int) -> tuple[float, float]:
    """Limits of the tool's speed and acceleration on the way to a via point; infinite where there is none."""
    way = tool_way.at(job.ways, via)
    both = []
    for key in ("speed_mm_s", "acceleration_mm_s2"):
        own = getattr(way, key) if way else None
        asked = own if own is not None else getattr(job, key)
        both.append(np.inf if asked is None else asked)
    return both[0], both[1]


def _tool_limits(job: Job, path: _Path) -> ToolLimits:
    """The tool's limits on each segment; where a corner is cut, its segments keep those of both ways."""
    segments = path.knots[-1]
    limits = np.full((2, segments), np.inf)
    for via, (first, last) in enumerate(pairwise(path.arrivals), 1):
        from_rest, to_rest = first in path.knots, last in path.knots
        own = slice(first if from_rest else first - 1, last if to_rest else last + 1)
        limits[:, own] = np.minimum(limits[:, own], np.array(_asked(job, via))[:, None])
    return ToolLimits(*limits)


def _limit_notes(job: Job, path: _Path, refine: int, times: Array, tool: Tool) -> list[str]:
    """What the tool reaches on each way whose speed or acceleration the job limits, proven."""
    angles, axis = _bernstein(path.angle_points_deg, refine), of_path(times[:, None], DEGREE)[:, :, 0]
    notes = []
    for via, (first, last) in enumerate(pairwise(path.arrivals), 1):
        asked = _asked(job, via)
        if not np.any(np.isfinite(asked)):
            continue
        own = slice(first * refine, last * refine)
        found = reached(angles[own], axis[own], tool)
        words = [
            f"{value:.4g} {unit}"
            for value, limit, unit in zip(found, asked, ("mm/s", "mm/s²"), strict=True)
            if np.isfinite(limit)
        ]
        notes.append(f"P{via - 1} to P{via}: the tool moves at no more than {' and '.join(words)} (proven)")
    return notes
