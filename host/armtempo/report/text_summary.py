"""Summaries of plans and runs as lines of text, and of plans as JSON values."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from armtempo_shared import motion
from armtempo_shared.limits import MAX_MOTION_BYTES

from armtempo.basics.text import aligned
from armtempo.diagnosis.figures import findings as coarse_steps
from armtempo.model.arm import Arm
from armtempo.model.job import AUTO, GRADIENT
from armtempo.model.plan import Plan, Search
from armtempo.planning import checks, path_deviation, torque
from armtempo.planning.free import free_plan
from armtempo.report.replayed import JointResult
from armtempo.splines.trajectory import Trajectory

_HEAD = (
    ("joint", "time", "floor", "over", "speed", "acceleration", "jerk"),
    ("", "s", "s", "%", "deg/s", "deg/s²", "deg/s³"),
)
_WIDTHS = (12, 8, 8, 7, 16, 16, 17)
_RESULT_WIDTHS = (11, 11, 12, 12)
_FLOORS = {
    "rests": "from turn to turn of a joint under its speed, acceleration and jerk limits",
    "path": "along the path under the speed, acceleration and jerk limits of all its joints",
    "together": "through the via points under the speed, acceleration and jerk limits of all joints, whatever the path",
    "vias": "through the via angles of a joint under its speed, acceleration and jerk limits, whatever the path",
}
"""Meaning of ``Search.floor_kind``."""
_WORTH_SAYING = 0.03
"""A free path is mentioned if it might save more than this fraction of the motion time."""


def lines(plan: Plan) -> list[str]:
    """Lines on a plan: motion times with lower bounds, extremes with limits, notes, joints with coarse steps."""
    job = plan.job
    text = [f"{job.name}: {plan.trajectory.duration_s:.4f} s, {', '.join(_settings(plan))}"]
    text.extend(aligned([*_HEAD, *(_row(plan, joint) for joint in range(len(plan.extremes)))], _WIDTHS))
    for kind in sorted({search.floor_kind for search in plan.searches}):
        text.append(f"floor: least time {_FLOORS[kind]}")
    text.extend(_free_path(plan))
    text.extend(_polished(search) for search in plan.searches if search.optimum_s)
    text.extend(_started(search) for search in plan.searches if len(search.starts_s))
    if job.timing == "per-joint" and len(plan.searches) > 1:
        text.extend(_separation(plan))
    if job.refine == AUTO:
        text.append(f"record: {record_bytes(plan)} bytes of the {MAX_MOTION_BYTES} that the board takes")
    text.extend(f"note: {note}" for note in plan.notes)
    text.extend(torque_lines([(plan.holding, plan.trajectory)]))
    text.extend(
        f"{each.level.value}: {each.where}: {each.what}; {each.next_step}" for each in coarse_steps(plan.arm)
    )
    return text


def torque_lines(motions: Iterable[tuple[Arm, Trajectory]]) -> list[str]:
    """The motor with the least torque to spare in these motions, each with the arm and its load there."""
    found = [least for arm, motion in motions if (least := torque.least_margin(arm, motion))]
    if not found:
        return []
    least = min(found)
    level = "warning" if least.margin < torque.ENOUGH else "torque"
    prudent = f"; {torque.ENOUGH:g} is prudent" if least.margin < torque.ENOUGH else ""
    return [f"{level}: {least.joint} has the least to spare: {least.words}{prudent}"]


def result_lines(results: Iterable[JointResult]) -> list[str]:
    """Lines on a run: each joint's steps, final angle and its error."""
    rows = [["joint", "steps sent", "angle", "error"], ["", "net", "deg", "deg"]]
    rows += [
        [joint.name, str(joint.steps_sent), f"{joint.angle_deg:.3f}", f"{joint.error_deg:+.4f}"]
        for joint in results
    ]
    return aligned(rows, _RESULT_WIDTHS)


def record_bytes(plan: Plan) -> int:
    """Size of the plan's motion record."""
    trajectory, first = plan.trajectory, plan.trajectory.joints[0]
    segments = len(first.angle_points_deg) - first.degree
    return motion.size(first.degree, len(trajectory.joints), trajectory.shared, segments, first.refine)


def _settings(plan: Plan) -> list[str]:
    """Phrases on how the plan was made."""
    job, first = plan.job, plan.trajectory.joints[0]
    auto = " (auto)" if job.refine == AUTO else ""
    timing = f"{job.timing} timing"
    if checks.is_free(job):
        pieces = len(first.angle_points_deg) - first.degree
        return ["free path", timing, f"{pieces} pieces{auto}", f"{job.starts} starts", f"seed {job.seed}"]
    if checks.has_stretches(job):
        pieces = len(first.angle_points_deg) - first.degree
        return [
            "tool led" if checks.leads_tool(job) else "with stops",
            timing,
            f"{pieces} pieces",
            f"refine {first.refine}{auto}",
        ]
    search = f"{job.optimiser}, {job.population} x {job.iterations}"
    if job.optimiser == GRADIENT:
        search = f"{job.optimiser}, {job.starts} starts"
    return [timing, f"degree {job.degree}", f"refine {first.refine}{auto}", search, f"seed {job.seed}"]


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
    floor, over = "-", "-"
    for search in plan.searches:
        if joint in search.joints:
            floor, over = f"{search.floor_s:.4f}", f"{100 * (search.total_s / search.floor_s - 1):.2f}"
    pairs = zip(plan.extremes[joint].values, limits.values, strict=True)
    reached = [f"{value:.2f} / {limit:g}" for value, limit in pairs]
    return plan.arm.driven[joint].name, time, floor, over, *reached


def _polished(search: Search) -> str:
    gap = max(search.total_s / search.optimum_s - 1, 0.0)
    joints = ", ".join(str(joint + 1) for joint in search.joints)
    return (
        f"polished, driven joint {joints}: {search.searched_s:.4f} s to {search.total_s:.4f} s, "
        f"within {gap:.1e} of the best nearby with {len(search.intervals_s)} variables"
    )


def _free_path(plan: Plan) -> list[str]:
    """The most that a free path could save; nothing if that is little or the path is given."""
    job, total_s = plan.job, plan.trajectory.duration_s
    if job.path != "through" or checks.has_stretches(job):
        return []
    floor_s = free_plan.floor_of(plan.arm, job, plan.via_deg, [*range(len(plan.arm.driven))]).time_s
    if (saved := 1.0 - floor_s / total_s) <= _WORTH_SAYING:
        return []
    return [
        f'path = "free" may save up to {100.0 * saved:.0f} %: no path through the via points takes less than '
        f"{floor_s:.4f} s"
    ]


def _separation(plan: Plan) -> list[str]:
    """For per-joint timing: differences of the joints' times at the via points, and the tool's deviation."""
    spread = ", ".join(f"{value:.2f}" for value in path_deviation.via_spread_s(plan.trajectory))
    apart = f"joints pass the via points apart by {spread} s"
    if checks.is_free(plan.job):
        return [apart]
    stray = path_deviation.tool_stray_mm(plan.arm, plan.trajectory)
    return [
        apart,
        f'so the tool strays up to {stray:.1f} mm from its path; timing = "shared" keeps it there',
    ]


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
        "torque": least._asdict() if (least := torque.least_margin(plan.holding, plan.trajectory)) else None,
    }


def _joint_values(plan: Plan, joint: int) -> dict[str, Any]:
    driven = plan.arm.driven[joint]
    floors = [search.floor_s for search in plan.searches if joint in search.joints]
    return {
        "name": driven.name,
        "duration_s": plan.trajectory.joints[joint].duration_s,
        "floor_s": floors[0] if floors else None,
        "extremes": dict(zip(_QUANTITIES, map(float, plan.extremes[joint].values), strict=True)),
        "limits": dict(zip(_QUANTITIES, driven.limits.values, strict=True)),
    }
