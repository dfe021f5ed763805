"""``armtempo speed``: how fast what moves goes on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click
from armtempo_shared import wire

from armtempo.basics.errors import BoardError, LinkError
from armtempo.cli import chosen, options, results

if TYPE_CHECKING:
    from armtempo.robot.board import Board
    from armtempo.robot.shared_board import SharedBoard


@click.command()
@click.argument("percent", type=click.FloatRange(1, 100))
@options.port
@options.log_traffic
@options.as_json
def command(percent: float, port: str | None, log_traffic: Path | None, as_json: bool) -> None:
    """Let what moves go on at PERCENT of its planned speed.

    PERCENT: 1 to 100.

    The arm stays on its path; the speed goes over smoothly, in the time in which the motion can brake. Where another
    armtempo program has the port, it is asked to do it, and what it starts later runs at that speed too.
    """
    words = f"{percent:g} % of the planned speed"
    change(
        port, log_traffic, Asked("speed", lambda board: board.speed(percent / 100), words, percent), as_json
    )


@dataclass(frozen=True)
class Asked:
    """A change of speed."""

    what: str
    """The command."""
    ask: Callable[[Board | SharedBoard], None]
    words: str
    percent: float | None = None
    """Of the planned speed; None: as before the pause."""


def change(port: str | None, log_traffic: Path | None, asked: Asked, as_json: bool) -> None:
    """Ask for it, through the program that has the port where there is one, and say so."""
    name = chosen.port(port, others=True)
    program = _ask(name, log_traffic, asked)
    values = {"asked": asked.what, "speed_percent": asked.percent, "port": name, "program": program}
    results.show(as_json, values, [asked.words + (f", through {program}" if program else "")])


def _ask(name: str, log_traffic: Path | None, asked: Asked) -> str | None:
    """Ask for it; through which program, None where over the port itself."""
    from armtempo.robot.shared_board import SharedBoard

    with chosen.shared_or_own(name, log_traffic) as board:
        if asked.what == "speed" and not isinstance(board, SharedBoard) and not board.status().moving:
            raise LinkError("nothing moves", "'armtempo run --speed' begins at a lower speed")
        try:
            asked.ask(board)
        except BoardError as error:
            if error.code != wire.ERROR_CODES["not_moving"]:
                raise
            raise LinkError(
                f"there is nothing to {asked.what}: nothing moves", "start a motion first"
            ) from None
        return board.program if isinstance(board, SharedBoard) else None
