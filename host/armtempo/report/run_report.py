"""The report of a run folder: a page, and for one motion its figures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from armtempo.basics.atomic_file import replace_text
from armtempo.kinematics import chain
from armtempo.model.arm import Arm
from armtempo.planning import torque
from armtempo.report import arm_picture, drawing, html_page, plots, sections
from armtempo.report.evaluation import Evaluation, LegEvaluation, evaluate
from armtempo.splines.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PAGE = "report.html"
_HEADINGS = {
    "torque": "Torque",
    "convergence": "The search",
    "postures": "The arm along its path",
}
_POSTURES = 7
_PATH_POINTS = 300


def write(folder: Path) -> Path:
    """Write report.html, and for one motion its figures (SVG), into the run folder; returns the page's path.

    Raises RunFolderError if a motion is not known, or nothing was recorded.
    """
    return write_page(evaluate(folder))


def write_page(found: Evaluation) -> Path:
    """The same for a run that is evaluated already."""
    drawn = figures(found.legs[0]) if found.single else {}
    for name, (figure, _) in drawn.items():
        drawing.save(figure, found.run.path / f"{name}.svg")
    path = found.run.path / PAGE
    replace_text(path, render(found, drawn))
    return path


def figures(found: LegEvaluation) -> dict[str, tuple[Figure, str]]:
    """The figures by file name, each with its caption."""
    trajectory, names, limits = found.trajectory, found.names, found.limits
    band = " with its standard error (band)" if found.curves.measured.any() else ""
    drawn = {
        "tracking": (
            plots.tracking(found.curves, trajectory, limits, names, found.units),
            f"{_what_is_seen(found)} (solid){band}, the plan (dotted), limits (dashed).",
        ),
        "errors": (
            plots.errors(found.curves, names, found.units),
            f"{_what_is_seen(found)} minus planned angle: every repetition (pale) and their mean.",
        ),
    }
    if found.solution and found.solution.searches:
        searches = {_serves(names, search.joints): search for search in found.solution.searches}
        polished_s = {name: search.total_s for name, search in searches.items() if search.optimum_s}
        end = "; where the gradient solver ended after it (dot)" if polished_s else ""
        drawn["convergence"] = (
            plots.convergence({name: search.history_s for name, search in searches.items()}, polished_s),
            f"Best fitness after each iteration of the search{end}.",
        )
    return drawn if found.arm is None else drawn | _of_arm(found.arm, trajectory)


def _of_arm(arm: Arm, trajectory: Trajectory) -> dict[str, tuple[Figure, str]]:
    """Figures of the motors' torque and of the arm along its path."""
    drawn = {}
    torques = torque.of_motion(arm, trajectory)
    if torques and (least := torques.least):
        drawn["torque"] = (
            plots.torque(torques, torque.ENOUGH),
            f"Torque that each motor holds of what the plan needs. {least.joint} has the least to spare: "
            f"{least.description}. Below 1 steps are lost, from {torque.ENOUGH:g} on it is prudent (dashed).",
        )
    if len(arm.joints) > 1:
        times = np.linspace(0.0, trajectory.duration_s, _PATH_POINTS)
        stops = trajectory(np.linspace(0.0, trajectory.duration_s, _POSTURES))
        drawn["postures"] = (
            arm_picture.postures(chain.chains_mm(arm, stops), chain.tool_path_mm(arm, trajectory, times)),
            f"The arm at {_POSTURES} equally spaced times, from its start to its end, and the path of its tool.",
        )
    return drawn


def _what_is_seen(found: LegEvaluation) -> str:
    """What the curves show."""
    measured = found.curves.measured
    if measured.all():
        return "Measured mean"
    if not measured.any():
        return "Commanded by step pulses"
    return "Measured mean, of joints without an encoder the command by step pulses"


def render(found: Evaluation, drawn: dict[str, tuple[Figure, str]]) -> str:
    """The page as HTML."""
    meta, entries = found.run.meta, found.run.entries
    done = sum(entry.complete for entry in entries)
    arm = next((leg.arm.name for leg in found.legs if leg.arm), meta.get("arm", "not known"))
    sheet = html_page.Page(
        f"Run of {meta['name']!r}",
        f"{meta['started']}, arm {arm}, {done} of {len(entries)} repetitions complete",
    )
    sections.result(sheet, found)
    for name, (figure, caption) in drawn.items():
        if name in _HEADINGS:
            sheet.heading(_HEADINGS[name])
        sheet.figure(drawing.inline_svg(figure, name, caption), caption)
        if name == "errors":
            _planned(sheet, found)
    sections.course(sheet, found)
    _origin(sheet, found)
    return sheet.render()


def _planned(sheet: html_page.Page, found: Evaluation) -> None:
    sheet.heading("The plan")
    if found.plan and found.legs[0].solution:
        sections.plan_extremes(sheet, found.plan)
        sections.plan_timing(sheet, found.plan)
        return
    board = "it was on the board, and is read back from its record"
    why = "the plan of a sequence keeps its motions alone" if found.plan else board
    lasts_s = found.legs[0].trajectory.duration_s
    sheet.note(f"How this motion was planned is not known: {why}. It lasts {lasts_s:.3f} s.")


def _origin(sheet: html_page.Page, found: Evaluation) -> None:
    run = found.run
    sheet.heading("How to repeat it")
    repeat = "" if any(entry.rows for entry in run.entries) else f" --repeat {len(run.repetitions)}"
    sheet.code(f"armtempo run {run.plan_path.name if run.plan_path else run.meta['name']}{repeat}")
    known: list[tuple[str, str]] = [
        (key, _flat(run.meta[key])) for key in ("port", "board") if key in run.meta
    ]
    if "virtual" in run.meta:
        known.append(("virtual board", "yes" if run.meta["virtual"] else "no"))
    sections.origin(sheet, found.plan, known)


def _flat(value: object) -> str:
    """A value of run.json as text; a table as pairs of name and value."""
    if isinstance(value, dict):
        return ", ".join(f"{name.replace('_', ' ')} {item}" for name, item in value.items())
    return str(value)


def _serves(names: Sequence[str], joints: Sequence[int]) -> str:
    return ", ".join(names[joint] for joint in joints)
