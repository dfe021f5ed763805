"""The report's section on the result: verdict, measured compared with planned, steps, peaks with limits."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from armtempo.report import analysis, html_page, peaks, verdict
from armtempo.report.evaluation import Evaluation

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
    "steps planned": "step pulses from the start of the motion to its end; negative: downwards",
    "steps made": "what the board counted in the last repetition",
    "one step (°)": "what one step turns the joint by",
    "command off plan (°)": "largest difference of the commanded from the planned angle at a sample: half a step is "
    "rounding",
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
_MEASURED_PEAKS = ("measured", "verdict")
"""Columns that are omitted if nothing was measured."""
_COLOURS = {
    peaks.EXCEEDED: html_page.BAD,
    peaks.KEPT: html_page.GOOD,
    peaks.WITHIN: html_page.GOOD,
    peaks.UNDECIDED: html_page.OPEN,
}


def write(sheet: html_page.Page, found: Evaluation) -> None:
    """The verdict and its tables."""
    result = verdict.of(found)
    sheet.verdict(
        result.state, result.summary, [(finding.state, finding.text) for finding in result.findings]
    )
    for text in found.complaints:
        if "cut short" in text:
            sheet.note(text, html_page.BAD)
    sheet.heading("Result")
    if found.curves.measured.any():
        _measured(sheet, found)
    _steps(sheet, found)
    if found.limits:
        _peaks(sheet, found)
    else:
        sheet.note("The folder does not say which arm it was, so the motion is not checked against limits.")


def _measured(sheet: html_page.Page, found: Evaluation) -> None:
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
    sheet.table(tuple(_MEASURED), rows, "Measured against the plan: mean of the repetitions", _MEASURED)


def _steps(sheet: html_page.Page, found: Evaluation) -> None:
    start, end = verdict.planned_steps(found)
    made = found.last.commanded_steps[-1] - start
    off = np.abs(found.last.commanded_deg - found.trajectory(found.last.path_s)).max(axis=0)
    rows = [
        [joint.name, str(end[n] - start[n]), str(made[n]), f"{1 / joint.steps_per_deg:.4f}", f"{off[n]:.4f}"]
        for n, joint in enumerate(found.run.joints)
    ]
    sheet.table(tuple(_STEPS), rows, "Step pulses", _STEPS)


def _peaks(sheet: html_page.Page, found: Evaluation) -> None:
    seen = bool(found.curves.measured.any())
    rows: list[Sequence[object]] = []
    for name, most, checks in zip(found.names, found.extremes, found.limit_checks, strict=True):
        for quantity, unit, value, check in zip(
            ("speed", "acceleration"), ("°/s", "°/s²"), most.values, checks, strict=False
        ):
            cells = (name, quantity, f"{value:.2f}", f"{check.limit:g} {unit}")
            rows.append((*cells, *_measured_peak(check)) if seen else cells)
    columns = {name: text for name, text in _PEAKS.items() if seen or name not in _MEASURED_PEAKS}
    sheet.table(tuple(columns), rows, "Peaks and their limits", columns)


def _measured_peak(check: peaks.LimitCheck) -> tuple[object, object]:
    """The cells of _MEASURED_PEAKS."""
    measured = "–" if np.isnan(check.peak) else f"{check.peak:.2f} ± {check.sigma:.2f}"
    return measured, (check.verdict, _COLOURS.get(check.verdict, ""))
