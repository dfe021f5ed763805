"""``armtempo rename``: another name for a stored motion."""

from __future__ import annotations

from pathlib import Path

import click

from armtempo.cli import options


@click.command()
@click.argument("old")
@click.argument("new")
@options.port
@options.log_traffic
def command(old: str, new: str, port: str, log_traffic: Path | None) -> None:
    """Rename the stored motion OLD to NEW."""
    with options.board(port, log_traffic) as board:
        board.rename(old, new)
    click.echo(f"{old} is now {new}")
