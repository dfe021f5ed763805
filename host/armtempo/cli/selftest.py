"""``armtempo selftest``: the board measures itself."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click

from armtempo.basics.errors import InputError
from armtempo.cli import options, resolve, results
from armtempo.cli.options import BoardOptions
from armtempo.cli.results import ProgressBar
from armtempo.diagnosis.selftest.result import Measurement, SelfTest
from armtempo.report import selftest_page as page
from armtempo.robot.motor_test import ARM_FILE


@click.command("selftest")
@options.folder(
    "--out",
    "-o",
    help="Write selftest.json and a page with figures, selftest.html, to FOLDER.",
)
@options.force("files of an earlier self-test in FOLDER")
@click.option(
    "--with-motors",
    is_flag=True,
    help="Ask first, then move each joint up to a degree there and back; you press switches and E-stop.",
)
@options.board(options.arm_of_board)
def selftest(given: BoardOptions, out: Path | None, force: bool, with_motors: bool) -> None:
    """Let the board measure itself: clocks, flash, pulses.

    Clocks, flash, memory, link, pulses, E-stop. Nothing needs to be connected, and nothing moves: the drivers must
    be off, and stay off. The board is reset at the end, and the arm's position is unknown afterwards. With
    --with-motors it asks, then moves each joint of the homed arm and compares directions and encoders with the arm
    file. Exit code 1 if anything is wrong.
    """
    if out is not None:
        page.check_free(out, force)
    if given.arm_path is not None and not with_motors:
        raise InputError("--arm needs --with-motors", "leave it out: the board has its arm's record")
    given = replace(given, port=resolve.port(given.port))
    found = _with_motors(given) if with_motors else _alone(given)
    if out is not None:
        page.write(found, out)
    results.show(given.as_json, found.to_json(), _lines(found))
    if found.failed:
        raise SystemExit(1)


def _alone(given: BoardOptions) -> SelfTest:
    with resolve.board(given) as board, ProgressBar("self-test") as progress:
        return board.selftest(progress)


def _with_motors(given: BoardOptions) -> SelfTest:
    arm = resolve.named_arm(given.arm_path)
    with resolve.board(given, arm) as board:
        return board.motor_test(
            resolve.arm_of_board(board, arm),
            ask=lambda question: click.confirm(question, err=True),
            tell=lambda what: results.echo(what, err=True),
        )


def _lines(found: SelfTest) -> list[str]:
    kind = ", a virtual one: its figures are simulated" if found.simulated else ""
    lines = [f"self-test of board {found.board_id}{kind}"]
    for line in found.lines:
        lines.extend(_format_line(line))
    if to_correct := found.data.get(ARM_FILE):
        lines += ["to correct in the arm file:", *(f"  {line}" for line in to_correct)]
    wrong = len(found.failed)
    lines.append(f"{wrong} of {len(found.lines)} lines are wrong" if wrong else "nothing is wrong")
    return lines


def _format_line(line: Measurement) -> list[str]:
    expected = f"   (expected: {line.expected})" if line.expected else ""
    words = [f"  {line.verdict.word:<6}{line.part:<8}{line.what}: {line.measured}{expected}"]
    return [*words, f"  {'':<14}-> {line.cure}"] if line.cure else words
