"""``armtempo selftest``: the board measures itself."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from armtempo.cli import chosen, options, results
from armtempo.cli.progress import ProgressBar

if TYPE_CHECKING:
    from armtempo.selftest.result import Measurement, SelfTest


@click.command()
@click.option(
    "--out",
    "-o",
    type=click.Path(file_okay=False, path_type=Path),
    metavar="FOLDER",
    help="Write selftest.json and a page with figures, selftest.html, to FOLDER.",
)
@options.force("the files of an earlier self-test in FOLDER")
@options.port
@options.log_traffic
@options.as_json
def command(out: Path | None, force: bool, port: str | None, log_traffic: Path | None, as_json: bool) -> None:
    """Let the board measure itself: clocks, flash, memory, link, pulses, E-stop.

    Nothing needs to be connected, and nothing moves: the drivers must be off, and stay so. The board is reset at the
    end, so the arm's position is unknown then. Exit code 1 where anything is wrong.
    """
    from armtempo.selftest import page

    if out is not None:
        page.check_free(out, force)
    with chosen.board(chosen.port(port), log_traffic) as board, ProgressBar("self-test") as progress:
        found = board.selftest(progress)
    if out is not None:
        page.write(found, out)
    results.show(as_json, found.to_json(), _lines(found))
    if found.failed:
        raise SystemExit(1)


def _lines(found: SelfTest) -> list[str]:
    kind = "virtual board: its figures are simulated" if found.simulated else "board"
    lines = [f"self-test of {kind} {found.board_id}"]
    for line in found.lines:
        lines.extend(_words(line))
    wrong = len(found.failed)
    lines.append(f"{wrong} of {len(found.lines)} lines are wrong" if wrong else "nothing is wrong")
    return lines


def _words(line: Measurement) -> list[str]:
    expected = f"   (expected: {line.expected})" if line.expected else ""
    words = [f"  {line.verdict.value:<6}{line.part:<8}{line.what}: {line.measured}{expected}"]
    return [*words, f"  {'':<14}-> {line.cure}"] if line.cure else words
