"""``armtempo speed``: how fast what moves goes on."""

from __future__ import annotations

from pathlib import Path

import click

from armtempo.cli import chosen, options


@click.command()
@click.argument("percent", type=click.FloatRange(1, 100))
@options.port
@options.log_traffic
def command(percent: float, port: str | None, log_traffic: Path | None) -> None:
    """Let what moves go on at PERCENT of its planned speed.

    The arm stays on its path; the speed goes over smoothly, in the time in which the motion can brake. Where another
    armtempo program has the port, it is asked to do it, and what it starts later runs at that speed too.
    """
    from armtempo.robot.speed import permille

    change(port, log_traffic, permille(percent / 100), f"{percent:g} % of the planned speed")


def change(port: str | None, log_traffic: Path | None, rate: int, said: str) -> None:
    """Ask for a rate in thousandths, through the program that has the port where there is one, and say so."""
    from armtempo.robot import shared_board
    from armtempo.robot.speed import change_speed

    name = chosen.port(port, others=True)
    shared = shared_board.find(name)
    if shared is not None:
        with shared:
            shared.speed(rate)
            click.echo(f"{said}, through {shared.program}")
        return
    with chosen.board(name, log_traffic) as board:
        if not board.status().moving:
            raise click.ClickException("nothing moves; 'armtempo run --speed' begins at a lower speed")
        change_speed(board.client, rate)
    click.echo(said)
