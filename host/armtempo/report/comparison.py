"""Two or more runs on one page, side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.atomic_file import replace_text
from armtempo.basics.errors import RunFolderError
from armtempo.model.joint_unit import heads
from armtempo.report import analysis, drawing, html_page, plots
from armtempo.report.evaluation import Evaluation, LegEvaluation, evaluate

PAGE = "comparison.html"
_COLUMNS = {
    "run": "",
    "joint": "",
    "degree": "of the joint's splines",
    "time (s)": "motion time of the joint",
    "angle RMS (°)": "root mean square, over the whole motion, of measured minus planned angle; without an encoder, of "
    "commanded minus planned",
    "speed RMS (°/s)": "the same of the speed, differentiated from the angles",
    "acceleration RMS (°/s²)": "the same of the acceleration",
    "lag at start (ms)": f"by how much the speed is late in the first {analysis.EDGE_S:g} s; negative: early",
    "lag at end (ms)": f"the same in the last {analysis.EDGE_S:g} s of the joint's motion",
}


def write(folders: Sequence[Path], path: Path) -> Path:
    """Write the comparison of run folders to ``path``; it names folders that cannot be read.

    Raises RunFolderError if fewer than two are readable.
    """
    readable, complaints = _read(folders)
    if len(readable) < 2:
        raise RunFolderError(
            "a comparison needs two readable runs: " + "; ".join(complaints),
            "give two or more runs that can be read",
        )
    replace_text(path, render(readable, complaints))
    return path


def render(found: dict[str, Evaluation], complaints: Sequence[str]) -> str:
    """The page, for evaluations by name."""
    sheet = html_page.Page("Runs compared", ", ".join(found))
    known = {name: arm for name, run in found.items() for leg in run.legs[:1] if (arm := leg.arm)}
    if len({replace(arm, source="") for arm in known.values()}) > 1:
        arms = ", ".join(f"{name} of {arm.name}" for name, arm in known.items())
        sheet.note(
            f"These runs are of different arms (name, geometry, limits or drives): {arms}.", html_page.BAD
        )
    for text in complaints:
        sheet.note(text, html_page.BAD)
    for name, evaluation in found.items():
        for text in evaluation.complaints:
            sheet.note(f"{name}: {text}", html_page.BAD)
    legs = {
        name if run.single else f"{name}, motion {leg.number}": leg
        for name, run in found.items()
        for leg in run.legs
    }
    sheet.heading("Result")
    _table(sheet, legs)
    for joint in range(max((len(leg.names) for leg in legs.values()), default=0)):
        name, caption = f"joint-{joint + 1}", f"Joint {joint + 1}: mean angle, speed, acceleration and error."
        sheet.heading(f"Joint {joint + 1}")
        units = [leg.units[joint] for leg in legs.values() if joint < len(leg.units)]
        drawn = plots.overlay(_of_joint(legs, joint), units[0])
        sheet.figure(drawing.inline_svg(drawn, name, caption), caption)
    return sheet.render()


def _read(folders: Sequence[Path]) -> tuple[dict[str, Evaluation], list[str]]:
    readable: dict[str, Evaluation] = {}
    complaints = []
    for folder in folders:
        try:
            evaluation = evaluate(folder)
        except RunFolderError as error:
            complaints.append(error.problem)
            continue
        name = folder.resolve().name
        readable[name if name not in readable else str(folder)] = evaluation
    return readable, complaints


def _table(sheet: html_page.Page, found: dict[str, LegEvaluation]) -> None:
    rows = []
    for name, evaluation in found.items():
        deviation = analysis.deviations(evaluation.curves)
        lags = analysis.lags_s(evaluation.curves, evaluation.trajectory)
        for joint, spline in enumerate(evaluation.trajectory.joints):
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
    units = dict.fromkeys(unit for evaluation in found.values() for unit in evaluation.units)
    columns = heads(_COLUMNS, units)
    sheet.table(tuple(columns), rows, "The mean of the repetitions against the plan", columns)


def _of_joint(found: dict[str, LegEvaluation], joint: int) -> dict[str, tuple[Array, Array, Array]]:
    """By run: times (K,), mean (3, K) and angle error (K,)."""
    return {
        name: (
            evaluation.curves.times_s,
            evaluation.curves.mean[:, :, joint],
            np.asarray(evaluation.curves.mean[0, :, joint] - evaluation.curves.theory[0, :, joint]),
        )
        for name, evaluation in found.items()
        if joint < len(evaluation.names)
    }
