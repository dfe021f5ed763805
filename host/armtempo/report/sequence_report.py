"""The report of a recorded sequence: a page on how it ended and how well each motion was followed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from armtempo.basics.arrays import Array
from armtempo.basics.atomic_file import replace_text
from armtempo.model.steps import position, whole_cycles
from armtempo.report import html_page
from armtempo.report.run_folder import transmission
from armtempo.report.run_report import PAGE
from armtempo.report.sequence_reader import SequenceRun
from armtempo.report.verdict import BAD, GOOD, OPEN, STEPS_OFF, Verdict, VerdictItem

END_S = 1e-3
"""A sample this close to the end of the motion is its last."""
_LEGS = {
    "motion": "its number, as in the file NAME-1, NAME-2 … on the board",
    "what": "",
    "planned (s)": "how long it takes at 100 % speed",
    "runs": "number of reported runs",
    "whole": "runs of which every sample arrived, to their end",
    "joint": "",
    "command off plan (steps)": "largest difference of the commanded from the planned angle at a sample: half a step "
    "is rounding",
    "at the end (steps)": "the same at the end of each whole run",
    "largest (°)": "largest difference of the measured from the planned angle; – without an encoder",
    "RMS (°)": "root mean square of these differences over all samples",
}


@dataclass(frozen=True, eq=False)
class LegResult:
    """A motion of the sequence: its reported runs, checked against its plan."""

    number: int
    """Number from 1."""
    words: str
    """Description of the first row that runs it."""
    duration_s: float
    runs: int
    whole: int
    """Number of complete runs: every sample arrived, to the end of the motion."""
    command_off_steps: Array
    """(J,): largest difference of the commanded from the planned angle, in steps; half a step is rounding."""
    end_off_steps: Array
    """(J,): the same at the ends of complete runs; NaN without one."""
    measured_off_deg: Array
    """(J,): largest difference of the measured from the planned angle; NaN for a joint without an encoder."""
    measured_rms_deg: Array
    """(J,): the root mean square of these differences."""


def results(found: SequenceRun) -> tuple[LegResult, ...]:
    """The motions that ran, in the order of their numbers."""
    return tuple(_results(found))


def _results(found: SequenceRun) -> Iterator[LegResult]:
    motions = np.array([found.motion_of(row) if row >= 0 else 0 for row in found.row], dtype=np.int64)
    for number in range(1, len(found.legs) + 1):
        chosen = np.flatnonzero(motions == number)
        if chosen.size:
            yield _leg(found, number, chosen)


def _leg(found: SequenceRun, number: int, chosen: NDArray[np.int64]) -> LegResult:
    samples, leg = found.samples, found.legs[number - 1]
    planned = leg(np.minimum(samples.path_s[chosen], leg.duration_s))
    command = np.abs(transmission(found.joints).steps(samples.commanded_deg[chosen] - planned))
    measured = np.abs(samples.angle_deg[chosen] - planned)
    runs = found.run[chosen]
    at_end = samples.path_s[chosen] >= leg.duration_s - END_S
    whole = [
        run for run in np.unique(runs) if _is_whole(samples.index[chosen][runs == run], at_end[runs == run])
    ]
    ends = at_end & np.isin(runs, whole)
    nothing = np.full(len(found.joints), np.nan)
    return LegResult(
        number,
        str(found.meta["rows"][int(found.row[chosen[0]])]["words"]),
        leg.duration_s,
        len(np.unique(runs)),
        len(whole),
        command.max(axis=0),
        command[ends].max(axis=0) if ends.any() else nothing,
        measured.max(axis=0),
        np.sqrt(np.mean(measured**2, axis=0)),
    )


def _is_whole(index: NDArray[np.int64], at_end: NDArray[np.bool_]) -> bool:
    return bool(np.array_equal(index, np.arange(len(index))) and at_end.any())


def write(folder: Path) -> Path:
    """Write report.html into the folder of a recorded sequence; returns its path. RunFolderError if it is none."""
    found = SequenceRun.load(folder)
    path = folder / PAGE
    replace_text(path, render(found))
    return path


def verdict_of(folder: Path) -> Verdict:
    """The verdict on the recorded sequence in a folder; raises RunFolderError if it is none."""
    found = SequenceRun.load(folder)
    return verdict(found, results(found))


def verdict(found: SequenceRun, legs: tuple[LegResult, ...]) -> Verdict:
    """The verdict: how it ended, whether everything arrived, whether the arm followed."""
    items = [_ending(found), *_losses(found, legs), *_followed(found, legs)]
    order = (BAD, OPEN, GOOD)
    return Verdict(tuple(sorted(items, key=lambda item: order.index(item.state))))


def render(found: SequenceRun) -> str:
    """The page as HTML."""
    legs = results(found)
    result = verdict(found, legs)
    meta = found.meta
    sheet = html_page.Page(
        f"Run of sequence {found.name!r}", f"{meta['started']}, arm {meta.get('arm', 'not known')}"
    )
    sheet.verdict(result.state, result.summary, [(item.state, item.text) for item in result.findings])
    sheet.heading("Its motions")
    if legs:
        sheet.table(tuple(_LEGS), [row for leg in legs for row in _rows(found, leg)], explained=_LEGS)
    else:
        sheet.note("No motion was recorded.")
    sheet.heading("How it went")
    sheet.table(("what", "value"), list(_course(found)))
    sheet.note("Each row as it passed is in rows.csv, each sample with its row in samples.csv.")
    return sheet.render()


def _ending(found: SequenceRun) -> VerdictItem:
    ended = found.meta.get("ended") or {}
    where = f"in {position(ended['step'], ended['cycle'])}" if ended else _last(found)
    if found.state == "finished":
        return VerdictItem(GOOD, f"finished after {whole_cycles(ended['cycle'])}")
    if found.state == "stopped":
        return VerdictItem(OPEN, f"stopped {where}")
    code = f" ({ended['code']})" if ended.get("code") else ""
    return VerdictItem(BAD, f"{found.state.replace('_', ' ')}{code} {where}")


def _last(found: SequenceRun) -> str:
    last = found.last
    if last is None:
        return "before its first row was reported"
    return f"after row {last.row} ({last.words}), {position(last.step, last.cycle)}, was reported"


def _losses(found: SequenceRun, legs: tuple[LegResult, ...]) -> Iterator[VerdictItem]:
    if found.rows_lost:
        yield VerdictItem(OPEN, f"{found.rows_lost} rows were not reported to the host")
    cut = sum(leg.runs - leg.whole for leg in legs)
    if cut:
        yield VerdictItem(OPEN, f"{cut} runs of motions lack samples, or did not reach their end")


def _followed(found: SequenceRun, legs: tuple[LegResult, ...]) -> Iterator[VerdictItem]:
    ends = [np.nanmax(leg.end_off_steps) for leg in legs if leg.whole]
    if ends and max(ends) > STEPS_OFF + 0.5:
        yield VerdictItem(BAD, f"a motion ended {max(ends):.1f} steps from its planned end")
    elif ends:
        yield VerdictItem(
            GOOD, f"each of {sum(leg.whole for leg in legs)} whole motions ended on its planned step"
        )
    measured = np.array([leg.measured_off_deg for leg in legs])
    for joint, column in zip(found.joints, measured.T if legs else (), strict=False):
        if not np.isfinite(column).any():
            yield VerdictItem(OPEN, f"{joint.name} has no encoder: its true position is not known")
        else:
            yield VerdictItem(
                GOOD, f"{joint.name} was measured at most {np.nanmax(column):.3f}° from the plan"
            )


def _rows(found: SequenceRun, leg: LegResult) -> Iterator[list[object]]:
    for index, joint in enumerate(found.joints):
        yield [
            leg.number,
            leg.words,
            f"{leg.duration_s:.3f}",
            leg.runs,
            leg.whole,
            joint.name,
            html_page.number(leg.command_off_steps[index], ".2f"),
            html_page.number(leg.end_off_steps[index], ".2f"),
            html_page.number(leg.measured_off_deg[index], ".3f"),
            html_page.number(leg.measured_rms_deg[index], ".3f"),
        ]


def _course(found: SequenceRun) -> Iterator[tuple[str, str]]:
    ended = found.meta.get("ended") or {}
    yield "ended", found.state
    if ended:
        yield "last step", str(ended["step"])
        yield "whole cycles", str(ended["cycle"])
    for name, value in (ended.get("counters") or {}).items():
        yield f"counter {name}", str(value)
    yield "reported rows", str(found.last.passed if found.last else 0)
    if (cycle_s := _cycle_s(found)) is not None:
        yield "time of a cycle, by the host's clock, median", f"{cycle_s:.3f} s"
    for key in ("port", "virtual"):
        if key in found.meta:
            yield key, str(found.meta[key])


def _cycle_s(found: SequenceRun) -> float | None:
    """Median time from the first reported row of a cycle to that of the next; None for fewer than three cycles."""
    begins: dict[int, float] = {}
    for row in found.rows:
        begins.setdefault(row.cycle, row.time_s)
    times = [begins[cycle + 1] - begun for cycle, begun in begins.items() if cycle + 1 in begins]
    return float(np.median(times)) if len(times) > 1 else None
