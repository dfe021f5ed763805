"""``armtempo stop``: end a motion."""

from __future__ import annotations

from pathlib import Path

import click

from armtempo.cli import options
from armtempo.cli.status import lines


@click.command()
@click.option("--now", is_flag=True, help="Freeze the step outputs instead of braking along the path.")
@options.port
@options.log_traffic
def command(now: bool, port: str, log_traffic: Path | None) -> None:
    """Brake or freeze, and say where the arm stands."""
    with options.board(port, log_traffic, any_program=True) as board:
        board.stop(now)
        for line in lines(board.status()):
            click.echo(line)
