"""The sections of a report: the result with its tables; the plan, its settings and versions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from armtempo.model.job import Job
from armtempo.model.joint_unit import heads
from armtempo.model.plan import Plan
from armtempo.planning import checks, path_deviation
from armtempo.report import analysis, html_page, peaks, verdict
from armtempo.report.evaluation import Evaluation, LegEvaluation
from armtempo.report.run_folder import transmission
from armtempo.report.run_reader import RepetitionData

_MEASURED = {
    "joint": "",
    "angle RMS (°)": "root mean square, over the whole motion, of measured minus planned angle",
    "largest (°)": "the largest of these differences",
    "final (°)": "measured minus planned angle at the last sample",
    "speed RMS (°/s)": "the same of the speed, differentiated from the angles",
    "acceleration RMS (°/s²)": "the same of the acceleration; most of it is the encoder's rounding",
    "lag at start (ms)": f"by how much the speed is late in the first {analysis.EDGE_S:g} s; negative: early",
    "lag at end (ms)": f"the same in the last {analysis.EDGE_S:g} s of the joint's motion",
}
_STEPS = {
    "joint": "",
    "steps planned": "step pulses of its motor from the start of the motion to its end; negative: downwards",
    "steps made": "what the board counted in the last repetition",
    "one step (°)": "what one step turns the joint by; a coupled joint: one step of each of its motors",
    "command off plan (°)": "largest difference of the commanded from the planned angle at a sample: half a step is "
    "rounding; up to its backlash while a motor crosses that",
}
_PEAKS = {
    "joint": "",
    "quantity": "",
    "planned": "the largest magnitude in the plan, exact",
    "limit": "what the arm file allows",
    "measured": "the largest magnitude measured ± its standard uncertainty; – without an encoder",
    "verdict": f"{peaks.KEPT}, {peaks.WITHIN} or {peaks.EXCEEDED}: three uncertainties more or less do not change it, "
    f"else it {peaks.UNDECIDED}; a time-optimal motion reaches its limits, so no measurement could show that one is "
    "kept exactly",
}
_LEGS = {
    "motion": "its number, as in the file NAME-1, NAME-2 … on the board",
    "what": "",
    "planned (s)": "how long it takes at 100 % speed",
    "runs": "number of recorded runs",
    "whole": "runs of which every sample arrived, to their end",
    "joint": "",
    "command off plan (steps)": "largest difference of the commanded from the planned angle at a sample: half a step "
    "is rounding; up to its backlash while a motor crosses that",
    "at the end (steps)": "largest difference of the step pulses from those planned, at the end of a run",
    "largest (°)": "largest difference of the measured from the planned angle; – without an encoder",
    "RMS (°)": "root mean square of these differences over all samples",
}
_MEASURED_PEAKS = ("measured", "verdict")
"""Columns that are omitted if nothing was measured."""
_COLOURS = {
    peaks.EXCEEDED: html_page.BAD,
    peaks.KEPT: html_page.GOOD,
    peaks.WITHIN: html_page.GOOD,
    peaks.UNDECIDED: html_page.OPEN,
}
_EXTREMES = {
    "joint": "",
    "motion time (s)": "when the joint arrives",
    "at least (s)": "no motion of this joint along its path keeps the limits in less time",
    "speed (°/s)": "the largest magnitude in the plan, exact, of what the arm file allows",
    "acceleration (°/s²)": "the same",
    "jerk (°/s³)": "the same",
}


def result(sheet: html_page.Page, found: Evaluation) -> None:
    """The verdict and its tables."""
    judged = verdict.of(found)
    sheet.verdict(
        judged.state, judged.summary, [(finding.state, finding.text) for finding in judged.findings]
    )
    for text in found.complaints:
        if "cut short" in text:
            sheet.note(text, html_page.BAD)
    if found.single:
        sheet.heading("Result")
        _of_motion(sheet, found.legs[0])
    elif found.legs:
        sheet.heading("Its motions")
        columns = heads(_LEGS, found.legs[0].units)
        sheet.table(tuple(columns), [row for leg in found.legs for row in _leg_rows(leg)], explained=columns)
    else:
        sheet.note("No motion was recorded.")


def course(sheet: html_page.Page, found: Evaluation) -> None:
    """How a sequence went: its end, its counters, its cycles."""
    for repetition, entry in zip(found.run.repetitions, found.run.entries, strict=True):
        if entry.rows:
            rows = [("ended", entry.state)]
            if entry.ended:
                rows += [("last step", str(entry.ended["step"])), ("whole cycles", str(entry.ended["cycle"]))]
                rows += [(f"counter {name}", str(value)) for name, value in entry.ended["counters"].items()]
            rows.append(("reported rows", str(len(repetition.rows))))
            if (cycle_s := _cycle_s(repetition)) is not None:
                rows.append(("time of a cycle, by the host's clock, median", f"{cycle_s:.3f} s"))
            sheet.heading("How it went")
            sheet.table(("what", "value"), rows)
            sheet.note(f"Each row as it began is in {entry.rows}, each sample with its row in {entry.file}.")


def _cycle_s(repetition: RepetitionData) -> float | None:
    """Median time from the first reported row of a cycle to that of the next; None for fewer than three cycles."""
    begins: dict[int, float] = {}
    for row in repetition.rows:
        begins.setdefault(row.cycle, row.time_s)
    times = [begins[cycle + 1] - begun for cycle, begun in begins.items() if cycle + 1 in begins]
    return float(np.median(times)) if len(times) > 1 else None


def _leg_rows(leg: LegEvaluation) -> Iterator[list[object]]:
    """The rows of _LEGS, one per joint."""
    path_s, commanded_deg, angle_deg = (
        np.concatenate([getattr(one, name) for one in leg.repetitions])
        for name in ("path_s", "commanded_deg", "angle_deg")
    )
    planned_deg = leg.trajectory(np.minimum(path_s, leg.trajectory.duration_s))
    command = np.abs(transmission(leg.joints).steps(commanded_deg - planned_deg)).max(axis=0)
    measured = np.abs(angle_deg - planned_deg)
    rms = np.sqrt(np.mean(measured**2, axis=0))
    ends = np.array(leg.ends_steps) - verdict.planned_steps(leg)[1] if leg.ends_steps else None
    for joint, name in enumerate(leg.names):
        yield [
            leg.number,
            leg.words,
            f"{leg.trajectory.duration_s:.3f}",
            len(leg.repetitions),
            leg.whole,
            name,
            html_page.number(command[joint], ".2f"),
            "–" if ends is None else str(np.abs(ends[:, joint]).max()),
            html_page.number(measured[:, joint].max(), ".3f"),
            html_page.number(rms[joint], ".3f"),
        ]


def _of_motion(sheet: html_page.Page, found: LegEvaluation) -> None:
    if found.curves.measured.any():
        _measured(sheet, found)
    _steps(sheet, found)
    if found.limits:
        _peaks(sheet, found)
    else:
        sheet.note("The folder does not say which arm it was, so the motion is not checked against limits.")


def _measured(sheet: html_page.Page, found: LegEvaluation) -> None:
    finals = analysis.final_errors(found.last, found.trajectory)
    lags = analysis.lags_s(found.curves, found.trajectory)
    deviation = analysis.deviations(found.curves)
    rows = [
        [
            name,
            html_page.number(deviation[0][joint].rms, ".3f"),
            html_page.number(deviation[0][joint].largest, ".3f"),
            html_page.number(finals[joint], "+.3f"),
            html_page.number(deviation[1][joint].rms, ".2f"),
            html_page.number(deviation[2][joint].rms, ".2f"),
            html_page.number(1000 * lags[0, joint], "+.0f"),
            html_page.number(1000 * lags[1, joint], "+.0f"),
        ]
        for joint, name in enumerate(found.names)
        if found.curves.measured[joint]
    ]
    columns = heads(_MEASURED, found.units)
    sheet.table(tuple(columns), rows, "Measured against the plan: mean of the repetitions", columns)


def _steps(sheet: html_page.Page, found: LegEvaluation) -> None:
    start, end = verdict.planned_steps(found)
    made = found.last.commanded_steps[-1] - start
    step_deg = transmission(found.joints).step_deg
    off = np.abs(found.last.commanded_deg - found.trajectory(found.last.path_s)).max(axis=0)
    rows = [
        [name, str(end[n] - start[n]), str(made[n]), f"{step_deg[n]:.4f}", f"{off[n]:.4f}"]
        for n, name in enumerate(found.names)
    ]
    columns = heads(_STEPS, found.units)
    sheet.table(tuple(columns), rows, "Step pulses", columns)


def _peaks(sheet: html_page.Page, found: LegEvaluation) -> None:
    seen = bool(found.curves.measured.any())
    rows: list[Sequence[object]] = []
    for joint, most, checked in zip(found.joints, found.extremes, found.limit_checks, strict=True):
        for quantity, per, value, check in zip(
            ("speed", "acceleration"), ("/s", "/s²"), most.values, checked, strict=False
        ):
            cells = (joint.name, quantity, f"{value:.2f}", f"{check.limit:g} {joint.unit.sign.strip()}{per}")
            rows.append((*cells, *_measured_peak(check)) if seen else cells)
    columns = {name: text for name, text in _PEAKS.items() if seen or name not in _MEASURED_PEAKS}
    sheet.table(tuple(columns), rows, "Peaks and their limits", columns)


def _measured_peak(check: peaks.LimitCheck) -> tuple[object, object]:
    """The cells of _MEASURED_PEAKS."""
    measured = "–" if np.isnan(check.peak) else f"{check.peak:.2f} ± {check.sigma:.2f}"
    return measured, (check.verdict, _COLOURS.get(check.verdict, ""))


def plan_extremes(sheet: html_page.Page, plan: Plan) -> None:
    """Motion times with their lower bounds, exact extremes with the limits, and the planner's notes."""
    rows = [_extremes_row(plan, joint) for joint in range(len(plan.extremes))]
    columns = heads(_EXTREMES, [joint.unit for joint in plan.arm.driven])
    sheet.table(tuple(columns), rows, "Motion time, and largest magnitudes with their limits", columns)
    for note in plan.notes:
        sheet.note(f"Note: {note}")


def plan_timing(sheet: html_page.Page, plan: Plan) -> None:
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


def origin(sheet: html_page.Page, plan: Plan | None, others: Sequence[tuple[str, str]]) -> None:
    """Settings and versions of the plan, if it is known, and ``others`` of the run."""
    rows = _settings(plan.job) if plan and not plan.is_sequence else []
    if plan:
        versions = plan.versions.items()
        rows += [(name if name == "machine" else f"version of {name}", value) for name, value in versions]
    sheet.table(("what", "value"), [*rows, *others])


def _settings(job: Job) -> list[tuple[str, str]]:
    return [
        ("path", job.path),
        ("optimiser", f"{job.optimiser}, population {job.population}, {job.iterations} iterations"),
        ("seed", str(job.seed)),
        ("degree, timing, refine", f"{job.degree}, {job.timing}, {job.refine}"),
    ]


def _extremes_row(plan: Plan, joint: int) -> list[str]:
    limits = plan.arm.driven[joint].limits
    bounds = [search.lower_bound_s for search in plan.searches if joint in search.joints]
    largest = zip(plan.extremes[joint].values, limits.values, strict=True)
    return [
        plan.arm.driven[joint].labelled,
        f"{plan.trajectory.joints[joint].duration_s:.4f}",
        f"{bounds[0]:.4f}" if bounds else "–",
        *(f"{value:.3f} of {most:g}" for value, most in largest),
    ]
