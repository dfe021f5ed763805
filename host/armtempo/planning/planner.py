"""Planning a job for an arm: via points, path, time axes, and the check that every plan must pass."""

from __future__ import annotations

import platform
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from importlib.metadata import version
from typing import NamedTuple

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.basics.installation import installed_version
from armtempo.basics.progress import Progress, watched
from armtempo.model import point_groups, tool_segment
from armtempo.model.arm import Arm
from armtempo.model.job import Job, Stop
from armtempo.model.leg import JobSolution
from armtempo.model.plan import Plan
from armtempo.model.tool_pose import Pose
from armtempo.model.tool_segment import ToolSegment
from armtempo.planning import checks, path_deviation, through_plan, workspace_check
from armtempo.planning.free import around
from armtempo.planning.through_plan import Planned
from armtempo.splines import extremes
from armtempo.splines.trajectory import Trajectory

_SWING_DEG = 1.0
"""A joint that goes farther than this beyond the via points on both sides of it is told."""
_LINE_REFINE = 4
"""Time segments per path segment of a straight line: within 1 % of the fastest, and planned quickly."""


def _by_lines(arm: Arm, job: Job, via_deg: Array, progress: Progress) -> Planned:
    from armtempo.planning.line import line_plan  # here, because most jobs need no kinematics

    return line_plan.motion(arm, job, via_deg, progress)


PLANNERS = {"through": through_plan.motion, "free": around.motion, "line": _by_lines}
"""What plans a job, by ``checks.planner_of``: from arm, job and via angles (n + 1, J) in degrees."""


@np.errstate(all="ignore")  # an overflow becomes NaN, which every check refuses
def plan(arm: Arm, job: Job, progress: Progress | None = None) -> Plan:
    """Plan the shortest motion that the search finds through the job's via points, from rest to rest.

    The same arm, job and seed give the same plan on the same machine and versions. Raises InputError if job
    and arm do not fit each other, PlanError if there is no motion within the limits and ranges; an exception
    of ``progress`` ends the planning.
    """
    arm = arm.with_tool(job.tool)
    checks.limits_of(arm)
    holding = arm.holding(job.holds)
    checks.check_job(arm, job)
    job, via, notes = points_of(arm, job)
    motion = PLANNERS[checks.planner_of(job)]
    with watched(progress) as watch:
        planned = motion(arm, job, via, watch)
    trajectory = planned.trajectory
    checks.check_time(trajectory)
    reached = extremes.of_joints(trajectory.joints)
    checks.check_reached(arm, reached)
    speeds_deg_s = np.array([each.speed_deg_s for each in reached])
    workspace_check.check_plan(holding, trajectory, speeds_deg_s, job.start_touches)
    notes = (*checks.hardware_notes(arm), *notes, *planned.notes, *_swing_note(arm, job, trajectory))
    return Plan.of_job(arm, JobSolution(job, via, planned.searches, reached), trajectory, notes, versions())


def _swing_note(arm: Arm, job: Job, trajectory: Trajectory) -> list[str]:
    """A note if a joint leaves the angles between two via points by more than ``_SWING_DEG``."""
    swing = path_deviation.widest_swing(trajectory, [each.via for each in job.tool_segments if each.line])
    if swing.beyond_deg <= _SWING_DEG:
        return []
    helps = 'path = "free" helps' if job.path == "through" else "a via point or a stop = true there keeps it"
    joint = arm.driven[swing.joint]
    return [
        f"between P{swing.via} and P{swing.via + 1} {joint.name} reaches {swing.reached_deg:.2f} "
        f"{joint.unit.word}, {swing.beyond_deg:.1f} beyond both; {helps}"
    ]


@cache
def versions() -> Mapping[str, str]:
    """The versions on which a plan's numbers depend."""
    return {
        "armtempo": installed_version(),
        "numpy": np.__version__,
        "scipy": version("scipy"),
        "python": platform.python_version(),
        "machine": platform.machine(),
    }


class PlannedPoints(NamedTuple):
    """What is planned of a job."""

    job: Job
    """Its via points less than a step apart are one."""
    via_deg: Array
    """(n + 1, J), the angles at its via points."""
    notes: tuple[str, ...]


def points_of(arm: Arm, job: Job) -> PlannedPoints:
    """The job and the angles that are planned; errors as in ``merged`` and ``via_angles``."""
    via, notes = via_angles(arm, job)
    job, kept, told = merged(arm, job, via)
    if told:
        via = via[kept]  # as a pose is solved from the point before, which may be gone from the job
        notes = via_angles(arm, job)[1]
    return PlannedPoints(job, via, (*told, *notes))


def via_angles(arm: Arm, job: Job) -> tuple[Array, tuple[str, ...]]:
    """Angles of the driven joints at the via points in degrees, (n + 1, J), and notes on poses."""
    arm = arm.with_tool(job.tool)
    if any(isinstance(via, Pose) for via in job.via):
        from armtempo.planning import via_points  # here, because most jobs need no kinematics

        resolved = via_points.resolve(arm, job)
        angles, notes = resolved.via_deg, tuple(note.text for note in resolved.notes)
    else:
        angles, notes = np.array(job.via, dtype=float), ()
    checks.check_via(arm, job, angles)
    angles = np.array([arm.placed(row) for row in angles])
    return angles, (*notes, *checks.long_ways(arm, angles))


def straight_line(
    arm: Arm,
    start_deg: Sequence[float],
    end: Sequence[float] | Pose,
    speed_mm_s: float | None = None,
    progress: Progress | None = None,
    holds: str = "",
) -> Trajectory:
    """A single straight line of the tool from a posture (J,) to another one, or to a pose; errors as in ``plan``.

    ``speed_mm_s``: the tool's limit; ``holds``: the load of the arm in it.
    """
    target = end if isinstance(end, Pose) else tuple(map(float, end))
    job = Job(
        "goto",
        via=(tuple(map(float, start_deg)), target),
        tool_segments=(ToolSegment(1, line=True, speed_mm_s=speed_mm_s),),
        refine=_LINE_REFINE,
        holds=holds,
    )
    return plan(arm, job, progress).trajectory


def slower(trajectory: Trajectory, speed: float) -> Trajectory:
    """The motion slowed down to the fraction ``speed``."""
    joints = tuple(
        replace(joint, time_points_s=np.asarray(joint.time_points_s / speed)) for joint in trajectory.joints
    )
    return replace(trajectory, joints=joints)


# via points less than a step apart
_KEYS = ("blend_mm", "speed_mm_s", "acceleration_mm_s2")


class Merged(NamedTuple):
    """A job without via points less than a step apart."""

    job: Job
    kept: list[int]
    """Of its via points, their numbers in the other job."""
    notes: tuple[str, ...]
    """One for each point that was several."""


def merged(arm: Arm, job: Job, via_deg: Array) -> Merged:
    """The job with via points as one that are less than a step of each motor apart.

    ``via_deg``: (n + 1, J), the angles at the via points. The first point of a group stays, or the motion's last; the
    two ends are never one. Stops stay, and their dwells add up; what is asked of the tool between points that become
    one counts for the way to them. Raises InputError if that is not the same, or a dwell would be at an end.
    """
    groups = point_groups.groups(arm.transmission.steps(via_deg), partial(_may_join, job))
    if len(groups) == len(job.via):
        return Merged(job, list(range(len(job.via))), ())
    last = len(job.via) - 1
    kept = [point_groups.kept(group, last) for group in groups]
    segments = []
    stops = []
    notes = []
    for number, group in enumerate(groups):
        if (segment := _segment(job, group)) is not None:
            segments.append(replace(segment, via=number))
        inside = [stop for stop in job.stops if stop.via in group]
        rest_s = sum(stop.dwell_s for stop in inside)
        if group[0] == 0 or group[-1] == last:
            if rest_s:
                raise _conflict(
                    job, group, f"the dwell_s of P{inside[0].via}", "is not at an end of the motion"
                )
        elif inside:
            stops.append(Stop(number, rest_s))
        if len(group) > 1:
            rests = f", with {rest_s:g} s of rest" if rest_s else ""
            place = via_deg[kept[number]].tolist()
            where = arm.texts.listed(f"{round(angle, 4) + 0.0:g}" for angle in place)
            notes.append(
                f"{_named(group)} are less than a step apart, and planned as one point, P{number} at {where}{rests}; "
                "later via points count from it"
            )
    via = tuple(job.via[number] for number in kept)
    found = replace(job, via=via, stops=tuple(stops), tool_segments=tuple(segments))
    return Merged(found, kept, tuple(notes))


def _may_join(job: Job, before: int, number: int) -> bool:
    """Whether nothing leads away and back between two via points, and a free path need not find its own places."""
    segment = tool_segment.at(job.tool_segments, number)
    if segment is not None and (segment.arc_through_mm or segment.circle_through_mm):
        return False
    return not (checks.is_free(job) and any(checks.is_wide(job.via[each]) for each in (before, number)))


def _segment(job: Job, group: Sequence[int]) -> ToolSegment | None:
    """What is asked of the tool on the way to a group of via points."""
    way = tool_segment.at(job.tool_segments, group[0])
    for number in group[1:]:
        inside = tool_segment.at(job.tool_segments, number)
        for key in _KEYS if inside is not None else ():
            value = getattr(inside, key)
            if value != getattr(way, key, None) and (
                value or (key == "blend_mm" and getattr(way, key, None))
            ):
                raise _conflict(job, group, f"{key} of P{number}", f"is not that of the way to P{group[0]}")
    return way


def _conflict(job: Job, group: Sequence[int], what: str, why: str) -> InputError:
    return InputError(
        f"job {job.name!r}: {_named(group)} are less than a step apart, so they are one point, but {what} {why}",
        "leave that out, or all but one of these via points",
    )


def _named(group: Sequence[int]) -> str:
    names = [f"P{number}" for number in group]
    return f"{', '.join(names[:-1])} and {names[-1]}"
