"""``armtempo selftest``: the board measures itself."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click

from armtempo.cli import chosen, options, results
from armtempo.cli.options import BoardOptions
from armtempo.cli.progress import ProgressBar
from armtempo.selftest import page
from armtempo.selftest.result import Measurement, SelfTest


@click.command("selftest")
@click.option(
    "--out",
    "-o",
    type=click.Path(file_okay=False, path_type=Path),
    metavar="FOLDER",
    help="Write selftest.json and a page with figures, selftest.html, to FOLDER.",
)
@options.force("the files of an earlier self-test in FOLDER")
@options.board()
def selftest(given: BoardOptions, out: Path | None, force: bool) -> None:
    """Let the board measure itself: clocks, flash, memory, link, pulses, E-stop.

    Nothing needs to be connected, and nothing moves: the drivers must be off, and are kept off. The board is reset at
    the end, so the arm's position is unknown then. Exit code 1 if anything is wrong.
    """
    if out is not None:
        page.check_free(out, force)
    given = replace(given, port=chosen.port(given.port))
    with chosen.board(given) as board, ProgressBar("self-test") as progress:
        found = board.selftest(progress)
    if out is not None:
        page.write(found, out)
    results.show(given.as_json, found.to_json(), _lines(found))
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
    words = [f"  {line.verdict.word:<6}{line.part:<8}{line.what}: {line.measured}{expected}"]
    return [*words, f"  {'':<14}-> {line.cure}"] if line.cure else words
