"""``armtempo speed``, ``pause`` and ``resume``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import click
from armtempo_shared import wire

from armtempo.basics.errors import BoardError, LinkError
from armtempo.cli import options, resolve, results
from armtempo.cli.options import BoardOptions
from armtempo.robot.board import Board
from armtempo.robot.shared_board import SharedBoard


@click.command("speed")
@click.argument("percent", type=options.FiniteRange(1, 100))
@options.board()
def speed(percent: float, given: BoardOptions) -> None:
    """Change the speed of the running motion, in percent.

    PERCENT: 1 to 100, of the planned speed.

    The arm stays on its path; the speed changes smoothly, within the motion's brake time. If another armtempo
    program has the port, that program changes it, and uses the speed for its next motions too.
    """
    words = f"{percent:g} % of the planned speed"
    _change(given, _Asked("speed", lambda board: board.speed(percent / 100), words, percent))


@dataclass(frozen=True)
class _Asked:
    """A change of speed."""

    what: str
    """The command."""
    ask: Callable[[Board | SharedBoard], None]
    words: str
    percent: float | None = None
    """Percentage of the planned speed; None: the speed before the pause."""


def _change(given: BoardOptions, asked: _Asked) -> None:
    """Make the change, through the program that has the port if there is one, and print it."""
    given = resolve.any_port(given)
    program = _ask(given, asked)
    values = {"asked": asked.what, "speed_percent": asked.percent, "port": given.port, "program": program}
    results.show(given.as_json, values, [asked.words + (f", through {program}" if program else "")])


def _ask(given: BoardOptions, asked: _Asked) -> str | None:
    """Make the change; returns the program that did it, None if over the port itself."""
    with resolve.shared_or_own(given) as board:
        if asked.what == "speed" and not isinstance(board, SharedBoard) and not board.status().moving:
            raise LinkError("nothing moves", "'armtempo run --speed' starts at a lower speed")
        try:
            asked.ask(board)
        except BoardError as error:
            if error.code != wire.ERROR_CODES["not_moving"]:
                raise
            raise LinkError(
                f"there is nothing to {asked.what}: nothing moves", "start a motion first"
            ) from None
        return board.program if isinstance(board, SharedBoard) else None


@click.command("pause")
@options.board()
def pause(given: BoardOptions) -> None:
    """Bring the running motion to rest on its path.

    'armtempo resume' continues it, 'armtempo stop' ends it. The drivers keep their current. A run with its pauses
    can last at most 1 h 49 min.
    """
    _change(given, _Asked("pause", lambda board: board.pause(), "paused", 0.0))


@click.command("resume")
@options.board()
def resume(given: BoardOptions) -> None:
    """Continue a paused motion at the speed before the pause."""
    _change(given, _Asked("resume", lambda board: board.resume(), "resumed"))
