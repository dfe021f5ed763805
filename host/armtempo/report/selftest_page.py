"""The files of a self-test: ``selftest.json``, and a page with its lines and figures."""

from __future__ import annotations

import json
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from armtempo.basics.atomic_file import os_reason, replace_text
from armtempo.basics.errors import InputError
from armtempo.diagnosis.finding import Level
from armtempo.diagnosis.selftest.pulse_part import CYCLES_PER_US, PULSES, SAFETY
from armtempo.diagnosis.selftest.result import SelfTest
from armtempo.report.drawing import PAGE_COLOUR, inline_svg
from armtempo.report.html_page import BAD, GOOD, OPEN, Page

JSON, HTML = "selftest.json", "selftest.html"
_KINDS = {Level.GOOD: GOOD, Level.ERROR: BAD, Level.NOTE: OPEN}


def check_free(folder: Path, force: bool) -> None:
    """Make ``folder``; raises InputError if that fails, or it has a self-test already (unless ``force``)."""
    there = [name for name in (JSON, HTML) if (folder / name).exists()]
    if there and not force:
        raise InputError(
            f"{folder / there[0]} already exists", "choose another folder, or replace it with --force"
        )
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be made: {os_reason(error)}", "choose another place") from None


def write(found: SelfTest, folder: Path) -> None:
    """Write both files."""
    replace_text(folder / JSON, json.dumps(found.to_json(), indent=1) + "\n")
    replace_text(folder / HTML, render(found))


def render(found: SelfTest) -> str:
    """The page as HTML."""
    kind = "; a virtual board, its figures are simulated" if found.simulated else ""
    page = Page("Self-test", f"board {found.board_id}, program {found.program_crc:08x}{kind}")
    wrong = [(BAD, f"{line.what}: {line.measured}. {line.cure}") for line in found.failed]
    page.verdict(BAD if wrong else GOOD, "Not OK" if wrong else "OK", wrong)
    for part in dict.fromkeys(line.part for line in found.lines):
        page.heading(part.capitalize())
        lines = [line for line in found.lines if line.part == part]
        rows = [
            (line.what, (line.measured, _KINDS[line.verdict]), line.expected, line.cure) for line in lines
        ]
        shown = 4 if any(line.cure for line in lines) else 3
        page.table(["what", "measured", "expected", "what to do"][:shown], [row[:shown] for row in rows])
    if find_spec("matplotlib"):
        for name, svg, caption in _figures(found.data):
            page.heading(name)
            page.figure(svg, caption)
    return page.render()


def _figures(data: dict[str, Any]) -> Iterator[tuple[str, str, str]]:
    from matplotlib.figure import Figure

    if errors := data.get(PULSES, {}).get("error_us"):
        figure = Figure(figsize=(7, 2.6), layout="constrained")
        axis = figure.add_subplot()
        for pin, (times_ms, off_us) in errors.items():
            axis.plot(times_ms, off_us, ".", markersize=3, label=f"P{pin}")
        axis.set(xlabel="time of the step, ms", ylabel="captured − planned, µs")
        axis.legend()
        yield "Step times", _svg(figure, "steps"), "Each step of the motion there, captured on its pin."
    stops = data.get(SAFETY, {}).get("cycles", {})
    if took := [cycles for way in stops.values() for cycles in way]:
        figure = Figure(figsize=(7, 2.2), layout="constrained")
        axis = figure.add_subplot()
        axis.hist([cycles / CYCLES_PER_US for cycles in took], bins=20, color="tab:blue")
        axis.set(xlabel="switch to frozen outputs, µs", ylabel="times")
        yield "E-stop and limit switch", _svg(figure, "stops"), "At random moments of the motion."


def _svg(figure: Any, name: str) -> str:
    for axis in figure.axes:
        axis.tick_params(colors=PAGE_COLOUR)
        for side in axis.spines.values():
            side.set_color(PAGE_COLOUR)
        for label in (axis.xaxis.label, axis.yaxis.label):
            label.set_color(PAGE_COLOUR)
    return inline_svg(figure, name, name)
