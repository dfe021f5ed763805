"""Two or more runs on one page, side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from armtempo.arrays import Array
from armtempo.errors import RunFolderError
from armtempo.formats.atomic_file import replace_text
from armtempo.report import html_page, plots, run_report
from armtempo.runs import analysis

PAGE = "comparison.html"


def write(folders: Sequence[Path], path: Path) -> Path:
    """Compare run folders on one page at ``path``; a folder that cannot be read is named there.

    Raises RunFolderError where fewer than two can be read.
    """
    readable, complaints = _read(folders)
    if len(readable) < 2:
        raise RunFolderError("fewer than two runs can be compared: " + "; ".join(complaints))
    replace_text(path, render(readable, complaints))
    return path


def render(found: dict[str, run_report.Evaluation], complaints: Sequence[str]) -> str:
    """The page, for evaluations by name."""
    sheet = html_page.Page("Runs compared", ", ".join(found))
    if len({replace(evaluation.plan.arm, source="") for evaluation in found.values()}) > 1:
        arms = ", ".join(f"{name} of {evaluation.plan.arm.name}" for name, evaluation in found.items())
        sheet.note(
            f"These runs are of different arms (name, geometry, limits or drives): {arms}.", html_page.BAD
        )
    for text in complaints:
        sheet.note(text, html_page.BAD)
    for name, evaluation in found.items():
        for text in evaluation.complaints:
            sheet.note(f"{name}: {text}", html_page.BAD)
    sheet.heading("Result")
    _table(sheet, found)
    joints = max(len(evaluation.names) for evaluation in found.values())
    for joint in range(joints):
        name, caption = f"joint-{joint + 1}", f"Joint {joint + 1}: mean angle, speed, acceleration and error."
        sheet.heading(f"Joint {joint + 1}")
        sheet.figure(plots.inline_svg(plots.overlay(_of_joint(found, joint)), name, caption), caption)
    return sheet.render()


def _read(folders: Sequence[Path]) -> tuple[dict[str, run_report.Evaluation], list[str]]:
    readable: dict[str, run_report.Evaluation] = {}
    complaints = []
    for folder in folders:
        try:
            evaluation = run_report.evaluate(folder)
        except RunFolderError as error:
            complaints.append(str(error))
            continue
        name = folder.resolve().name
        readable[name if name not in readable else str(folder)] = evaluation
    return readable, complaints


def _table(sheet: html_page.Page, found: dict[str, run_report.Evaluation]) -> None:
    rows = []
    for name, evaluation in found.items():
        deviation = analysis.deviations(evaluation.curves)
        lags = analysis.lags_s(evaluation.curves, evaluation.plan.trajectory)
        for joint, spline in enumerate(evaluation.plan.trajectory.joints):
            rows.append(
                [
                    name,
                    evaluation.names[joint],
                    str(spline.degree),
                    f"{spline.duration_s:.3f}",
                    *(html_page.number(deviation[order][joint].rms, ".3f") for order in range(3)),
                    *(html_page.number(1000 * lags[end, joint], "+.0f") for end in (0, 1)),
                ]
            )
    header = (
        "run",
        "joint",
        "degree",
        "time (s)",
        "angle RMS (°)",
        "speed RMS (°/s)",
        "acceleration RMS (°/s²)",
    )
    sheet.table((*header, "lag at start (ms)", "lag at end (ms)"), rows)


def _of_joint(found: dict[str, run_report.Evaluation], joint: int) -> dict[str, tuple[Array, Array, Array]]:
    """By run: times (K,), mean (3, K) and error of the angle (K,)."""
    return {
        name: (
            evaluation.curves.times_s,
            evaluation.curves.mean[:, :, joint],
            np.asarray(evaluation.curves.mean[0, :, joint] - evaluation.curves.theory[0, :, joint]),
        )
        for name, evaluation in found.items()
        if joint < len(evaluation.names)
    }
