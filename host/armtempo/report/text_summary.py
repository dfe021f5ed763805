"""Plans and runs in a few lines of text."""

from __future__ import annotations

from collections.abc import Iterable

from armtempo.formats.text_table import aligned
from armtempo.model.plan import Plan, Search
from armtempo.planning import path_deviation
from armtempo.runs.results import JointResult

_HEAD = (
    ("joint", "time", "floor", "over", "speed", "acceleration", "jerk"),
    ("", "s", "s", "%", "deg/s", "deg/s²", "deg/s³"),
)
_WIDTHS = (12, 8, 8, 7, 16, 16, 17)
_RESULT_WIDTHS = (11, 11, 12, 12)
_FLOORS = {
    "rests": "from turn to turn of a joint under its speed, acceleration and jerk limits",
    "path": "along the path under speed and acceleration limits alone",
}
"""What ``Search.floor_kind`` means."""


def lines(plan: Plan) -> list[str]:
    """A plan: motion times beside their lower bounds, extremes beside their limits; one string a line."""
    job = plan.job
    made = f"{job.optimiser}, {job.population} x {job.iterations}, seed {job.seed}"
    shape = f"degree {job.degree}, refine {job.refine}"
    text = [f"{job.name}: {plan.trajectory.duration_s:.4f} s, {job.timing} timing, {shape}, {made}"]
    text.extend(aligned([*_HEAD, *(_row(plan, joint) for joint in range(len(plan.extremes)))], _WIDTHS))
    for kind in sorted({search.floor_kind for search in plan.searches}):
        text.append(f"floor: least time {_FLOORS[kind]}")
    text.extend(_polished(search) for search in plan.searches if search.optimum_s)
    if job.timing == "per-joint" and len(plan.searches) > 1:
        text.extend(_separation(plan))
    text.extend(f"note: {note}" for note in plan.notes)
    return text


def result_lines(results: Iterable[JointResult]) -> list[str]:
    """A run: per joint the steps sent, the angle at the end and its error; one string a line."""
    rows = [["joint", "steps sent", "angle", "error"], ["", "net", "deg", "deg"]]
    rows += [
        [joint.name, str(joint.steps_sent), f"{joint.angle_deg:.3f}", f"{joint.error_deg:+.4f}"]
        for joint in results
    ]
    return aligned(rows, _RESULT_WIDTHS)


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


def _separation(plan: Plan) -> list[str]:
    """How far per-joint timing lets the joints pass the via points apart, and the tool leave the path."""
    spread = ", ".join(f"{value:.2f}" for value in path_deviation.via_spread_s(plan.trajectory))
    stray = path_deviation.tool_stray_mm(plan.arm, plan.trajectory)
    return [
        f"joints pass the via points apart by {spread} s",
        f'so the tool strays up to {stray:.1f} mm from its path; timing = "shared" keeps it there',
    ]
