"""The report of a run: one page and its figures, from a run folder and the plan in it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from armtempo.errors import RunFolderError
from armtempo.formats.atomic_file import replace_text
from armtempo.kinematics import chain
from armtempo.model import trajectory_file
from armtempo.model.arm import Arm, Limits
from armtempo.model.plan import Plan
from armtempo.report import html_page, plan_section, plots
from armtempo.runs import analysis, reader
from armtempo.runs.run_folder import COMPLETE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PAGE = "report.html"
_HEADINGS = {"motion": "The plan", "convergence": "The search", "postures": "The arm along its path"}
_POSTURES = 7
_PATH_POINTS = 300


@dataclass(frozen=True)
class Evaluation:
    """A run with its plan, its curves and what is wrong with it."""

    run: reader.RunData
    plan: Plan
    curves: analysis.Curves
    complaints: tuple[str, ...]

    @property
    def names(self) -> list[str]:
        """Names of the driven joints."""
        return [joint.name for joint in self.plan.arm.driven]

    @property
    def limits(self) -> list[Limits]:
        """Their limits."""
        return [joint.limits for joint in self.plan.arm.driven]


def evaluate(folder: Path) -> Evaluation:
    """Read and analyse a run folder; what is incomplete is listed in ``complaints``.

    Raises RunFolderError where there is no plan or not one sample.
    """
    run = reader.load(folder)
    if run.trajectory_path is None:
        raise RunFolderError(f"{folder}: has no trajectory.json, so there is no theory to compare with")
    plan = trajectory_file.load(run.trajectory_path)
    if len(run.joints) != len(plan.arm.driven):
        raise RunFolderError(
            f"{folder}: run.json tells of {len(run.joints)} joints, trajectory.json of {len(plan.arm.driven)}; "
            "they are not of one run"
        )
    usable = [repetition for repetition in run.repetitions if len(repetition.time_s)]
    if not usable:
        raise RunFolderError(f"{folder}: holds no sample; run it again")
    return Evaluation(run, plan, analysis.curves(usable, plan.trajectory), tuple(complaints(run)))


def resolutions_deg(arm: Arm) -> list[float]:
    """Degrees per encoder count of the driven joints; NaN for one without an encoder."""
    return [1.0 / joint.counts_per_deg if joint.encoder else np.nan for joint in arm.driven]


def complaints(run: reader.RunData) -> list[str]:
    """What is missing or broken in each repetition, one sentence each."""
    found = []
    for repetition, entry in zip(run.repetitions, run.entries, strict=True):
        steps = np.diff(repetition.index)
        if not len(repetition.time_s):
            found.append(f"{repetition.file}: {repetition.problem or 'no samples'}")
            continue
        if repetition.index[0] > 0:
            found.append(f"{repetition.file}: the first {repetition.index[0]} samples are missing")
        for at in np.flatnonzero(steps > 1):
            first, last = repetition.index[at] + 1, repetition.index[at + 1] - 1
            found.append(f"{repetition.file}: samples {first} to {last} are missing")
        if np.any(steps <= 0):
            found.append(f"{repetition.file}: the sample count starts again in the middle (a reset?)")
        if repetition.state != COMPLETE:
            end = repetition.time_s[-1]
            state = f"{entry.state} ({entry.fault})" if entry.fault else entry.state
            found.append(f"{repetition.file}: cut short, ended as {state} after {end:.1f} s")
    return found


def write(folder: Path) -> Path:
    """Write report.html and its figures (PNG and SVG) into the run folder; returns the page's path."""
    found = evaluate(folder)
    drawn = figures(found)
    for name, (figure, _) in drawn.items():
        for suffix in (".png", ".svg"):
            plots.save(figure, folder / f"{name}{suffix}")
    path = folder / PAGE
    replace_text(path, render(found, drawn))
    return path


def figures(found: Evaluation) -> dict[str, tuple[Figure, str]]:
    """The figures by file name, each with its caption."""
    plan, names, limits = found.plan, found.names, found.limits
    times = np.linspace(0.0, plan.trajectory.duration_s, _PATH_POINTS)
    stops = plan.trajectory(np.linspace(0.0, plan.trajectory.duration_s, _POSTURES))
    drawn = {
        "tracking": (
            plots.tracking(found.curves, plan.trajectory, limits, names),
            "Measured mean (solid) with its standard error (band), theory (dotted), limits (dashed).",
        ),
        "errors": (
            plots.errors(found.curves, names),
            "Measured minus planned angle: every repetition (pale) and their mean.",
        ),
        "motion": (
            plots.motion(plan.trajectory, limits, names),
            "The planned motion and its limits (dashed).",
        ),
    }
    if plan.searches:
        drawn["convergence"] = (
            plots.convergence({_serves(names, search.joints): search.history_s for search in plan.searches}),
            "Best fitness after each iteration of the search.",
        )
    if len(plan.arm.joints) > 1:
        drawn["postures"] = (
            plots.postures(
                chain.chains_mm(plan.arm, stops), chain.tool_path_mm(plan.arm, plan.trajectory, times)
            ),
            f"The arm at {_POSTURES} equally spaced times (paler: earlier) and the path of its tool.",
        )
    return drawn


def render(found: Evaluation, drawn: dict[str, tuple[Figure, str]]) -> str:
    """The whole page as HTML text."""
    meta, plan = found.run.meta, found.plan
    done = sum(repetition.state == COMPLETE for repetition in found.run.repetitions)
    sheet = html_page.Page(
        f"Run of {meta['name']!r}",
        f"{meta['started']}, arm {plan.arm.name}, "
        f"{done} of {len(found.run.repetitions)} repetitions complete",
    )
    for text in found.complaints:
        sheet.note(text, html_page.BAD)
    _result_tables(sheet, found)
    for name, (figure, caption) in drawn.items():
        if name in _HEADINGS:
            sheet.heading(_HEADINGS[name])
        if name == "motion":
            plan_section.extremes(sheet, plan)
        sheet.figure(plots.inline_svg(figure, name, caption), caption)
        if name == "motion":
            plan_section.timing(sheet, plan)
    _origin(sheet, found)
    return sheet.render()


def _result_tables(sheet: html_page.Page, found: Evaluation) -> None:
    sheet.heading("Result")
    last = [repetition for repetition in found.run.repetitions if len(repetition.time_s)][-1]
    finals = analysis.final_errors(last, found.plan.trajectory)
    lags = analysis.lags_s(found.curves, found.plan.trajectory)
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
    ]
    header = (
        "joint",
        "angle RMS (°)",
        "largest (°)",
        "final (°)",
        "speed RMS (°/s)",
        "acceleration RMS (°/s²)",
    )
    sheet.table(
        (*header, "lag at start (ms)", "lag at end (ms)"), rows, "Mean of the repetitions against theory"
    )
    _limit_table(sheet, found)


def _limit_table(sheet: html_page.Page, found: Evaluation) -> None:
    arm = found.plan.arm
    resolutions = resolutions_deg(arm)
    rows: list[Sequence[object]] = []
    for name, checks in zip(
        found.names, analysis.limit_checks(found.curves, found.limits, resolutions), strict=True
    ):
        for quantity, unit, check in zip(("speed", "acceleration"), ("°/s", "°/s²"), checks, strict=True):
            kind = {"exceeded": html_page.BAD, "not measured": ""}.get(check.verdict, html_page.GOOD)
            peak = f"{check.peak:.2f} ± {check.sigma:.2f}"
            measured = "–" if np.isnan(check.peak) else peak
            rows.append((name, quantity, measured, f"{check.limit:g}", unit, (check.verdict, kind)))
    caption = "Measured peaks beside the limits; ± one standard deviation from the encoder's rounding"
    sheet.table(("joint", "quantity", "peak", "limit", "unit", "verdict"), rows, caption)


def _origin(sheet: html_page.Page, found: Evaluation) -> None:
    meta = found.run.meta
    sheet.heading("How to repeat it")
    sheet.code("armtempo run trajectory.json --repeat " + str(len(found.run.repetitions)))
    known: list[tuple[str, str]] = [(key, _flat(meta[key])) for key in ("port", "board") if key in meta]
    if "virtual" in meta:
        known.append(("virtual board", "yes" if meta["virtual"] else "no"))
    plan_section.origin(sheet, found.plan, known)


def _flat(value: object) -> str:
    """A value of run.json as text; a table as name and value pairs."""
    if isinstance(value, dict):
        return ", ".join(f"{name.replace('_', ' ')} {item}" for name, item in value.items())
    return str(value)


def _serves(names: Sequence[str], joints: Sequence[int]) -> str:
    return ", ".join(names[joint] for joint in joints)
