"""Summaries of plans and runs as lines of text, and of plans as JSON values."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from armtempo_shared.limits import MAX_MOTION_BYTES

from armtempo.basics.errors import ArmtempoError
from armtempo.basics.text import aligned
from armtempo.diagnosis.figures import findings as coarse_steps
from armtempo.encoding import flash_use
from armtempo.model.arm import Arm
from armtempo.model.job import AUTO, GRADIENT
from armtempo.model.joint_unit import DEG, MM, names
from armtempo.model.leg import Search
from armtempo.model.plan import Plan
from armtempo.planning import board_limits, checks, path_deviation, rest_to_rest, torque
from armtempo.planning.free import free_plan
from armtempo.planning.free.free_plan import Trial
from armtempo.report.replayed import JointResult
from armtempo.splines.trajectory import Trajectory

_HEAD = (
    ("joint", "time", "at least", "speed", "acceleration", "jerk"),
    ("", "s", "s", "deg/s", "deg/s²", "deg/s³"),
)
_WIDTHS = (12, 8, 10, 16, 16, 17)
_RESULT_WIDTHS = (11, 11, 12, 12)
_BOUNDS = {
    "rests": "of one joint between its reversals, under its speed, acceleration and jerk limits",
    "path": "along the path under the speed, acceleration and jerk limits of all its joints",
    "together": "through the via points under the speed, acceleration and jerk limits of all joints, whatever the path",
    "vias": "through the via angles of a joint under its speed, acceleration and jerk limits, whatever the path",
}
"""Meaning of ``Search.lower_bound_kind``."""
_WORTH_SAYING = 0.03
"""What is faster than the spline through the via points is told if the spline takes longer by this fraction."""


def lines(plan: Plan, verbose: bool = False) -> list[str]:
    """Lines on a plan: motion time with its lower bound, extremes with limits, what would be faster, notes.

    ``verbose``: also how it was searched, what the bound is one of, and what the board has to do for it.
    """
    job = plan.job
    text = [f"{job.name}: {plan.total_s:.4f} s{_at_least(plan)}; {', '.join(_settings(plan, verbose))}"]
    units = tuple(text.replace("deg", plan.arm.texts.units) for text in _HEAD[1])
    rows = [_HEAD[0], units, *(_row(plan, joint) for joint in range(len(plan.extremes)))]
    text += aligned([row[:1] + row[3:] for row in rows] if plan.trajectory.shared else rows, _widths(plan))
    text += _faster(plan)
    if job.timing == "per-joint" and len(plan.searches) > 1:
        text.extend(_separation(plan, verbose))
    text.extend(f"note: {note}" for note in plan.notes)
    text.extend(torque_lines(plan.loaded_legs))
    text.extend(
        f"{each.level.value}: {each.where}: {each.what}; {each.next_step}" for each in coarse_steps(plan.arm)
    )
    return [*text, *_details(plan)] if verbose else text


def _details(plan: Plan) -> list[str]:
    """Lines on the search, its bounds and the board."""
    kinds = sorted({search.lower_bound_kind for search in plan.searches})
    return [
        *(f"lower bound: least time {_BOUNDS[kind]}" for kind in kinds),
        *(_polished(search) for search in plan.searches if search.optimum_s),
        *(_started(search) for search in plan.searches if len(search.starts_s)),
        f"record: {record_bytes(plan)} bytes of the {MAX_MOTION_BYTES} that the board takes",
        board_limits.format_rate(board_limits.step_rates(plan.arm, plan.extremes)),
    ]


def torque_lines(motions: Iterable[tuple[Arm, Trajectory]]) -> list[str]:
    """The motor with the least torque to spare in these motions, each with the arm and its load there."""
    found = [least for arm, motion in motions if (least := torque.least_margin(arm, motion))]
    if not found:
        return []
    least = min(found)
    level = "warning" if least.margin < torque.ENOUGH else "torque"
    prudent = f"; {torque.ENOUGH:g} is prudent" if least.margin < torque.ENOUGH else ""
    return [f"{level}: {least.joint} has the least to spare: {least.description}{prudent}"]


def result_lines(results: Iterable[JointResult]) -> list[str]:
    """Lines on a run: each joint's steps, final angle and its error."""
    results = list(results)
    unit = names(joint.unit for joint in results)
    what = (DEG if unit == DEG.name else MM).what
    rows = [["joint", "steps sent", what, "error"], ["", "net", unit, unit]]
    rows += [
        [
            joint.unit.labelled(joint.name),
            str(joint.steps_sent),
            f"{joint.angle_deg:.3f}",
            f"{joint.error_deg:+.4f}",
        ]
        for joint in results
    ]
    return aligned(rows, _RESULT_WIDTHS)


def record_bytes(plan: Plan) -> int:
    """Size of the plan's motion record."""
    return flash_use.of_trajectory(plan.trajectory)


def _widths(plan: Plan) -> tuple[int, ...]:
    """Of the table's columns; with shared timing it has none for times."""
    return (_WIDTHS[0], *_WIDTHS[3:]) if plan.trajectory.shared else _WIDTHS


def _at_least(plan: Plan) -> str:
    """The proven lower bound of the motion time, for the first line."""
    return (
        f", at least {max(search.lower_bound_s for search in plan.searches):.4f} s" if plan.searches else ""
    )


def _settings(plan: Plan, verbose: bool) -> list[str]:
    """Phrases on how the plan was made."""
    job, first = plan.job, plan.trajectory.joints[0]
    auto = " (auto)" if job.refine == AUTO else ""
    pieces = len(first.angle_points_deg) - first.degree
    if checks.planner_of(job) == "line":
        path = "tool led" if checks.leads_tool(job) else "with stops"
        more = [f"{pieces} pieces", f"refine {first.refine}{auto}"]
    elif checks.is_free(job):
        path, more = "free path", [f"{pieces} pieces{auto}", f"{job.starts} starts", f"seed {job.seed}"]
    else:
        search = f"{job.optimiser}, {job.population} x {job.iterations}"
        if job.optimiser == GRADIENT:
            search = f"{job.optimiser}, {job.starts} starts"
        path = "through the via points"
        more = [f"degree {job.degree}", f"refine {first.refine}{auto}", search, f"seed {job.seed}"]
    return [path, f"{job.timing} timing", *(more if verbose else ())]


def _started(search: Search) -> str:
    """The results of a gradient search's starts."""
    joints = ", ".join(str(joint + 1) for joint in search.joints)
    times = search.starts_s
    spread = 100.0 * (times.max() / times.min() - 1.0)
    return (
        f"{len(times)} starts, driven joint {joints}: {times.min():.4f} to {times.max():.4f} s, spread {spread:.3f} %; "
        f"the best continued to {search.total_s:.4f} s"
    )


def _row(plan: Plan, joint: int) -> tuple[str, ...]:
    limits = plan.arm.driven[joint].limits
    time = f"{plan.trajectory.joints[joint].duration_s:.4f}"
    bounds = [f"{search.lower_bound_s:.4f}" for search in plan.searches if joint in search.joints]
    pairs = zip(plan.extremes[joint].values, limits.values, strict=True)
    reached = [f"{value:.2f} / {limit:g}" for value, limit in pairs]
    return plan.arm.driven[joint].labelled, time, (bounds or ["-"])[0], *reached


def _polished(search: Search) -> str:
    gap = max(search.total_s / search.optimum_s - 1, 0.0)
    joints = ", ".join(str(joint + 1) for joint in search.joints)
    return (
        f"polished, driven joint {joints}: {search.searched_s:.4f} s to {search.total_s:.4f} s, "
        f"{100 * gap:.2g} % above the local optimum of its {len(search.intervals_s)} variables"
    )


def _faster(plan: Plan) -> list[str]:
    """What a free path, or stopping at every via point, would take, if the spline through them loses much to either."""
    job, total_s = plan.job, plan.total_s
    if job.path != "through" or checks.planner_of(job) == "line":
        return []
    limits = [joint.limits for joint in plan.arm.driven]
    others = {
        'path = "free"': _free_s(plan),
        "stopping at every via point": rest_to_rest.stopping_s(plan.via_deg, limits, job.timing == "shared"),
    }
    found = [f"{what} takes {time_s:.4f} s" for what, time_s in others.items() if _loses(total_s, time_s)]
    return [", ".join(found)] if found else []


def _loses(total_s: float, other_s: float) -> bool:
    return total_s > (1.0 + _WORTH_SAYING) * other_s


def _free_s(plan: Plan) -> float:
    """Motion time of a free path, from one start; infinite if it cannot save much, or there is none."""
    every = [*range(len(plan.arm.driven))]
    if not _loses(plan.total_s, free_plan.lower_bound_of(plan.arm, plan.job, plan.via_deg, every).time_s):
        return math.inf
    job = replace(plan.job, path="free", degree=5, refine=AUTO, starts=1)
    try:
        found = free_plan.motion(plan.arm, job, plan.via_deg, lambda _done, _whole: None, Trial())
    except ArmtempoError:
        return math.inf
    return found.trajectory.duration_s


def _separation(plan: Plan, verbose: bool) -> list[str]:
    """For per-joint timing: how far apart the joints pass a via point, and the tool's deviation."""
    times_s = path_deviation.via_spread_s(plan.trajectory)
    text = [f"the joints pass a via point up to {max(times_s):.2f} s apart"]
    if verbose:
        each = ", ".join(f"{value:.2f}" for value in times_s)
        text = [f"time from the first to the last joint at each via point: {each} s"]
    if not checks.is_free(plan.job):
        stray = path_deviation.tool_stray_mm(plan.arm, plan.trajectory)
        text.append(f'the tool strays up to {stray:.1f} mm from its path; timing = "shared" avoids that')
    return text


_QUANTITIES = ("speed_deg_s", "acceleration_deg_s2", "jerk_deg_s3")


def values(plan: Plan) -> dict[str, Any]:
    """Motion time, and each driven joint's time, lower bound, extremes and limits, with units in the keys."""
    return {
        "name": plan.job.name,
        "arm": plan.arm.name,
        "duration_s": plan.trajectory.duration_s,
        "timing": plan.job.timing,
        "seed": plan.job.seed,
        "record_bytes": record_bytes(plan),
        "joints": [_joint_values(plan, joint) for joint in range(len(plan.extremes))],
        "notes": list(plan.notes),
        "torque": least._asdict() if (least := torque.least_margin(*plan.loaded_legs[0])) else None,
    }


def _joint_values(plan: Plan, joint: int) -> dict[str, Any]:
    driven = plan.arm.driven[joint]
    bounds = [search.lower_bound_s for search in plan.searches if joint in search.joints]
    keys = [driven.unit.key(name) for name in _QUANTITIES]
    return {
        "name": driven.name,
        "duration_s": plan.trajectory.joints[joint].duration_s,
        "lower_bound_s": bounds[0] if bounds else None,
        "extremes": dict(zip(keys, map(float, plan.extremes[joint].values), strict=True)),
        "limits": dict(zip(keys, driven.limits.values, strict=True)),
    }
