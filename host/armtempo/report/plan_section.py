"""The report's section on the plan: extremes, timing, the planner's notes, settings to repeat it."""

from __future__ import annotations

from collections.abc import Sequence

from armtempo.model.plan import Plan
from armtempo.planning import checks, path_deviation
from armtempo.report import html_page

_EXTREMES = {
    "joint": "",
    "motion time (s)": "when the joint arrives",
    "floor (s)": "no motion of this joint along its path keeps the limits in less time",
    "speed (°/s)": "the largest magnitude in the plan, exact, of what the arm file allows",
    "acceleration (°/s²)": "the same",
    "jerk (°/s³)": "the same",
}


def extremes(sheet: html_page.Page, plan: Plan) -> None:
    """Motion times with their lower bounds, exact extremes with the limits, and the planner's notes."""
    rows = [_extremes_row(plan, joint) for joint in range(len(plan.extremes))]
    sheet.table(tuple(_EXTREMES), rows, "Motion time, and largest magnitudes with their limits", _EXTREMES)
    for note in plan.notes:
        sheet.note(f"Note: {note}")


def timing(sheet: html_page.Page, plan: Plan) -> None:
    """For per-joint timing: differences of the joints' times at the via points, and the tool's deviation."""
    if plan.job.timing != "per-joint" or len(plan.searches) < 2:
        return
    sheet.heading("Per-joint timing")
    rows: list[list[str]] = []
    times = [joint.via_times_s for joint in plan.trajectory.joints]
    for via, spread in enumerate(path_deviation.via_spread_s(plan.trajectory)):
        rows.append([f"P{via}", *(f"{joint[via]:.3f}" for joint in times), f"{spread:.3f}"])
    header = ("via point", *(f"{joint.name} (s)" for joint in plan.arm.driven), "apart by (s)")
    sheet.table(header, rows, "When each joint passes the via points")
    if checks.is_free(plan.job):
        return
    stray = path_deviation.tool_stray_mm(plan.arm, plan.trajectory)
    sheet.note(
        f"The joints do not pass a via point together, so the tool strays up to {stray:.1f} mm from the path "
        'that they would follow with timing = "shared".'
    )


def origin(sheet: html_page.Page, plan: Plan, others: Sequence[tuple[str, object]]) -> None:
    """Settings and versions of the plan, and ``others`` of the run."""
    job = plan.job
    rows: list[tuple[str, object]] = [
        ("path", job.path),
        ("optimiser", f"{job.optimiser}, population {job.population}, {job.iterations} iterations"),
        ("seed", job.seed),
        ("degree, timing, refine", f"{job.degree}, {job.timing}, {job.refine}"),
        *((f"version of {name}", value) for name, value in plan.versions.items()),
        *others,
    ]
    sheet.table(("what", "value"), [(name, str(value)) for name, value in rows])


def _extremes_row(plan: Plan, joint: int) -> list[str]:
    limits = plan.arm.driven[joint].limits
    floors = [search.floor_s for search in plan.searches if joint in search.joints]
    peaks = zip(plan.extremes[joint].values, limits.values, strict=True)
    return [
        plan.arm.driven[joint].name,
        f"{plan.trajectory.joints[joint].duration_s:.4f}",
        f"{floors[0]:.4f}" if floors else "–",
        *(f"{value:.3f} of {most:g}" for value, most in peaks),
    ]
