"""``armtempo speed``: how fast what moves goes on."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import click
from armtempo_shared.messages import RESUME

from armtempo.basics.errors import LinkError
from armtempo.cli import chosen, options, results


@click.command()
@click.argument("percent", type=click.FloatRange(1, 100))
@options.port
@options.log_traffic
@options.as_json
def command(percent: float, port: str | None, log_traffic: Path | None, as_json: bool) -> None:
    """Let what moves go on at PERCENT of its planned speed.

    The arm stays on its path; the speed goes over smoothly, in the time in which the motion can brake. Where another
    armtempo program has the port, it is asked to do it, and what it starts later runs at that speed too.
    """
    from armtempo.robot.speed import permille

    asked = Asked("speed", permille(percent / 100), f"{percent:g} % of the planned speed")
    change(port, log_traffic, asked, as_json)


@dataclass(frozen=True)
class Asked:
    """A change of speed."""

    what: str
    """The command."""
    rate: int
    """In thousandths of the planned speed, or RESUME."""
    words: str


def change(port: str | None, log_traffic: Path | None, asked: Asked, as_json: bool) -> None:
    """Ask for a rate, through the program that has the port where there is one, and say so."""
    name = chosen.port(port, others=True)
    program = _ask(name, log_traffic, asked.rate)
    percent = None if asked.rate == RESUME else asked.rate / 10
    values = {"asked": asked.what, "speed_percent": percent, "port": name, "program": program}
    results.show(as_json, values, [asked.words + (f", through {program}" if program else "")])


def _ask(name: str, log_traffic: Path | None, rate: int) -> str | None:
    """Ask for the rate; through which program, None where over the port itself."""
    from armtempo.robot.shared_board import SharedBoard
    from armtempo.robot.speed import change_speed

    with chosen.shared_or_own(name, log_traffic) as board:
        if isinstance(board, SharedBoard):
            board.speed(rate)
            return board.program
        if not board.status().moving:
            raise LinkError("nothing moves", "'armtempo run --speed' begins at a lower speed")
        change_speed(board.client, rate)
    return None
