"""The trajectory of a job whose path is free between its via points."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError, PlanError
from armtempo.basics.progress import Progress, part
from armtempo.model.arm import Arm
from armtempo.model.job import GRADIENT, Job
from armtempo.model.leg import Search
from armtempo.model.parts import Limits
from armtempo.model.tool_pose import Pose
from armtempo.planning import board_limits, checks, lower_bounds, through_plan
from armtempo.planning.fixed_path import FixedPath
from armtempo.planning.free import corridor, free_path
from armtempo.planning.free.angle_bounds import of_path
from armtempo.planning.free.free_motion import Demand, FreeMotion, Tolerance, through
from armtempo.planning.free.free_path import Effort, Shortest
from armtempo.planning.free.layout import DEGREE, DWELL_SEGMENTS, LEAST_PIECES, Layout, uniform
from armtempo.planning.lower_bounds import LowerBound
from armtempo.planning.through_plan import Planned
from armtempo.planning.time_parameterization import MIN_DURATION_S
from armtempo.planning.tool import Tool
from armtempo.planning.variables import time_points
from armtempo.splines import bspline, extremes, time_axis
from armtempo.splines.trajectory import JointSpline, Trajectory

_BEYOND = 2.0
"""A free path stays within this many spans of its via points on each side of them."""
_WORTH_USING = 1e-3
"""Smaller tolerances (mm or degrees) are not used."""
_ROUNDED = 1.001
"""Largest factor on time for rounding errors."""
_BY_ORDER = 1.0 / np.arange(1, 4)
"""Speed, acceleration and jerk are divided by these powers of the factor on time."""
_MARGINS = (0.0, 1e-8, 1e-7, 1e-6, 1e-5)
"""Further factors on time of successive attempts."""
_FAIR = 0.3 * checks.TOLERANCE
"""Allowed excess over a limit after the first attempt."""
_START_GAP = 1e-3
"""Relative gap of the time axis with which a path in a corridor starts."""
_WIDER = 0.5 * checks.TOLERANCE
"""Relative widening of ranges, so that a via point at their end is inside."""


@dataclass(frozen=True, eq=False)
class Trial:
    """How to plan a motion that only leads to another, or to its time.

    ``led``: whether the via points lead along a path that was found before; then one start will do. ``known``: a
    motion of the job with shared timing, without some of the tolerances; it is not planned again. ``rounds``: solves
    with the tolerances.
    """

    led: bool = False
    known: Planned | None = None
    rounds: int = free_path.ROUNDS


def motion(arm: Arm, job: Job, via_deg: Array, progress: Progress, trial: Trial | None = None) -> Planned:
    """The motion through via angles (n + 1, J), or near them at poses with a tolerance.

    A ``trial`` is planned without its lower bound, which takes time; it is 0 then. Raises InputError for a job that
    the board cannot hold, PlanError if no path stays within the ranges.
    """
    most = _most_segments(arm, job, len(via_deg))
    spline = None
    if _in_corridor(job) and not job.stops:
        spline = _on_spline(arm, job, via_deg, part(progress, 0, 2) or progress)
        progress = part(progress, 1, 2) or progress
    moving = [int(joint) for joint in np.flatnonzero(np.ptp(via_deg, axis=0) > checks.TOLERANCE)]
    groups = [moving] if job.timing == "shared" else [[joint] for joint in moving]
    found = []
    for number, joints in enumerate(groups):
        demand = _demand(arm, job, via_deg, joints)
        pieces = job.refine if isinstance(job.refine, int) else None
        if pieces is None and len(groups) > 1:
            pieces = free_path.automatic_pieces(len(via_deg) - 1, most)
        effort = Effort(pieces, most, job.starts, np.random.default_rng([job.seed, joints[0]]))
        if trial is not None:
            known = None if trial.known is None else _shortest(trial.known, demand)
            effort = replace(effort, led=trial.led, known=known, rounds=trial.rounds)
        if spline is not None:
            pieces = pieces or free_path.automatic_pieces(len(via_deg) - 1, most)
            effort = replace(effort, along_s=_axis_s(demand, spline, pieces))
        try:
            found.append(free_path.shortest(demand, effort, part(progress, number, len(groups)) or progress))
        except PlanError:
            if spline is None:
                raise
    if spline is not None and (not found or found[0].motion.total_s >= spline.trajectory.duration_s):
        return spline
    trajectory = _kept(arm, _trajectory(job, via_deg, groups, found))
    points = np.stack([joint.angle_points_deg for joint in trajectory.joints], axis=1)
    checks.check_ranges(arm, points, DEGREE)
    searches = tuple(
        _search(arm, job, via_deg, joints, one, trial is not None)
        for joints, one in zip(groups, found, strict=True)
    )
    return Planned(trajectory, searches, _notes(arm, job, via_deg, groups, found))


def _shortest(planned: Planned, demand: Demand) -> Shortest:
    """What a motion with shared timing was made of."""
    (search,) = planned.searches
    joints = planned.trajectory.joints
    assert joints[0].via_segments is not None  # a free path has these
    waits = [demand.stops.get(via, 0.0) > 0.0 for via in range(len(demand.via_deg) - 1)]
    pieces = np.diff(joints[0].via_segments) - DWELL_SEGMENTS * np.array(waits)
    points = np.stack([joints[joint].angle_points_deg for joint in search.joints], axis=1)
    motion = FreeMotion(Layout(pieces, demand.stops), points, np.diff(joints[0].time_points_s))
    return Shortest(motion, search.starts_s)


def _in_corridor(job: Job) -> bool:
    return job.corridor_deg is not None or job.corridor_mm is not None


def _on_spline(arm: Arm, job: Job, via_deg: Array, progress: Progress) -> Planned | None:
    """The plan on the spline through the via points, which is in any corridor; None if it leaves a joint's range."""
    on_it = replace(job, path="through", corridor_deg=None, corridor_mm=None, refine="auto")
    try:
        planned = through_plan.motion(arm, on_it, via_deg, progress)
    except PlanError:
        return None
    searches = (
        replace(search, lower_bound_s=bound.time_s, lower_bound_kind=bound.kind)
        for search in planned.searches
        for bound in (
            lower_bound_of(arm, job, via_deg, list(search.joints), planned.trajectory.joints[0].via_times_s),
        )
    )
    note = "no faster path was found in the corridor than the spline through the via points itself"
    if job.refine != "auto":
        note += f', with refine = {job.refine}; try refine = "auto" (--refine auto)'
    return replace(planned, searches=tuple(searches), notes=(*planned.notes, note))


def _axis_s(demand: Demand, spline: Planned, pieces: int) -> Array:
    """Differences of the optimal time axis with ``pieces`` segments per leg of the spline."""
    joint = spline.trajectory.joints[0]
    start = time_axis.cut(np.diff(joint.time_points_s), joint.refine, pieces, DEGREE)
    limits = [Limits(*values) for values in demand.limits]
    path = FixedPath(bspline.fit(demand.via_deg, DEGREE), DEGREE, limits, pieces)
    return path.optimum(start, _START_GAP).differences_s


def _most_segments(arm: Arm, job: Job, vias: int) -> int:
    """The most segments of a free path that the board's record can hold; raises InputError if too few."""
    most = board_limits.most_segments(arm, job.timing == "shared")
    pieces = job.refine if isinstance(job.refine, int) else LEAST_PIECES
    needed = uniform(vias, pieces, {stop.via: stop.dwell_s for stop in job.stops}).segments
    if needed > most:
        raise InputError(
            f"job {job.name!r}: a free path through {vias} via points with {pieces} pieces between any two needs "
            f"{needed} segments, the board's record holds {most}",
            'lower refine, use fewer via points or path = "through"',
        )
    return most


def _demand(arm: Arm, job: Job, via_deg: Array, joints: list[int]) -> Demand:
    """The job's requirements for these joints."""
    via = via_deg[:, joints]
    driven = [arm.driven[joint] for joint in joints]
    low, high = np.array([joint.range_deg for joint in driven]).T
    margin = _WIDER * np.maximum(1.0, np.maximum(np.abs(low), np.abs(high)))
    span = np.ptp(via, axis=0)
    tool = Tool(arm, joints, via_deg[0])
    tolerances = _tolerances(job, via, tool)
    return Demand(
        names=tuple(joint.name for joint in driven),
        via_deg=via,
        limits=np.array([joint.limits.values for joint in driven]),
        low_deg=np.maximum(low - margin, via.min(axis=0) - _BEYOND * span),
        high_deg=np.minimum(high + margin, via.max(axis=0) + _BEYOND * span),
        stops={stop.via: stop.dwell_s for stop in job.stops},
        corridor_deg=np.inf if job.corridor_deg is None else job.corridor_deg,
        corridor_mm=np.inf if job.corridor_mm is None else job.corridor_mm,
        tool=tool if tolerances or job.corridor_mm is not None else None,
        tolerances=tolerances,
    )


def _tolerances(job: Job, via_deg: Array, tool: Tool) -> dict[int, Tolerance]:
    """Tolerances of the tool around its pose at via angles (n + 1, J), reduced by the miss of the pose there."""
    allowed = {}
    for number, pose in enumerate(job.via):
        if number and isinstance(pose, Pose) and checks.is_wide(pose):
            miss = tool.miss(via_deg[number], pose)
            turn_deg = pose.tolerance_deg - miss.rotation_deg if pose.fixed else np.inf
            left = Tolerance(pose.tolerance_mm - miss.position_mm, turn_deg)
            if min(left) > _WORTH_USING:
                allowed[number] = left
    return allowed


def _trajectory(job: Job, via_deg: Array, groups: list[list[int]], found: list[Shortest]) -> Trajectory:
    """All joints; a joint that does not move gets the longest time axis."""
    longest = max((one.motion for one in found), key=lambda motion: motion.total_s)
    by_joint = {
        joint: (one.motion, column)
        for joints, one in zip(groups, found, strict=True)
        for column, joint in enumerate(joints)
    }
    joints = []
    for joint in range(via_deg.shape[1]):
        if joint in by_joint:
            joints.append(_joint(*by_joint[joint]))
        else:
            still = np.full(longest.layout.segments + DEGREE, via_deg[0, joint])
            joints.append(_spline(longest, still))
    return Trajectory(job.name, tuple(joints), job.timing == "shared")


def _kept(arm: Arm, trajectory: Trajectory) -> Trajectory:
    """The trajectory, scaled slightly if rounding of control points exceeds a limit.

    For a very small move, the scaled times may be rounded differently: then it is scaled again, each time more.
    """
    for margin in _MARGINS:
        factors = [
            float(np.max((extremes.of_joints((spline,))[0].values / joint.limits.values) ** _BY_ORDER))
            for spline, joint in zip(trajectory.joints, arm.driven, strict=True)
        ]
        if trajectory.shared:
            factors = [max(factors)] * len(factors)
        if all(factor <= 1.0 + (margin and _FAIR) for factor in factors):
            break
        joints = (
            replace(spline, time_points_s=spline.time_points_s * (factor * (1.0 + margin)))
            if 1.0 < factor < _ROUNDED
            else spline
            for spline, factor in zip(trajectory.joints, factors, strict=True)
        )
        trajectory = replace(trajectory, joints=tuple(joints))
    return trajectory


def _joint(motion: FreeMotion, column: int) -> JointSpline:
    return _spline(motion, np.ascontiguousarray(motion.angle_points_deg[:, column]))


def _spline(motion: FreeMotion, angle_points_deg: Array) -> JointSpline:
    scale = max(1.0, MIN_DURATION_S / motion.total_s)
    times = time_points(motion.differences_s * scale, DEGREE)
    return JointSpline(DEGREE, 1, angle_points_deg, times, tuple(map(int, motion.layout.arrivals)))


def _search(arm: Arm, job: Job, via_deg: Array, joints: list[int], found: Shortest, trial: bool) -> Search:
    bound = (
        LowerBound(0.0, "vias")
        if trial
        else lower_bound_of(arm, job, via_deg, joints, found.motion.via_times_s)
    )
    return Search(
        joints=tuple(joints),
        intervals_s=found.motion.differences_s,
        total_s=max(found.motion.total_s, MIN_DURATION_S),
        searched_s=float(found.starts_s.min()),
        evaluations=len(found.starts_s),
        history_s=np.minimum.accumulate(found.starts_s),
        starts_s=found.starts_s,
        optimum_s=0.0,
        lower_bound_s=bound.time_s,
        lower_bound_kind=bound.kind,
    )


def lower_bound_of(
    arm: Arm, job: Job, via_deg: Array, joints: list[int], times_s: Array | None = None
) -> LowerBound:
    """Lower bound of the time of any path of some driven joints through via angles (n + 1, J).

    ``times_s``: see ``lower_bounds.of_vias``.
    """
    limits = [arm.driven[joint].limits for joint in joints]
    demand = _demand(arm, job, via_deg, joints)
    return lower_bounds.of_vias(demand.via_deg, limits, demand.stops, demand.tolerances, times_s)


def _unused(job: Job) -> list[str]:
    """A note on settings of the search for ``path = "through"`` that the job changes in vain."""
    changed = [
        name
        for name, default in Job.searching().items()
        if getattr(job, name) != default and not (name == "optimiser" and job.optimiser == GRADIENT)
    ]
    return [f'of no effect with path = "free": {", ".join(changed)}'] if changed else []


def _notes(
    arm: Arm, job: Job, via_deg: Array, groups: list[list[int]], found: list[Shortest]
) -> tuple[str, ...]:
    """Notes: proven distance of a path in a corridor from the spline through the via points."""
    notes = _unused(job)
    for joints, one in zip(groups, found, strict=True):
        demand = _demand(arm, job, via_deg, joints)
        if job.corridor_deg is not None:
            path = of_path(one.motion.angle_points_deg, DEGREE)
            away = corridor.joint_deviation_deg(path, through(demand, one.motion.layout))
            notes.append(
                f"no joint leaves the spline through the via points by more than {away:.4g} deg (proven)"
            )
        if job.corridor_mm is not None:
            away = free_path.tool_deviation_mm(demand, one.motion)
            notes.append(
                f"the tool leaves the spline through the via points by no more than {away:.4g} mm (proven)"
            )
    return tuple(notes)
