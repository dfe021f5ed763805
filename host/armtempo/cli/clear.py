"""``armtempo clear``: clear a fault."""

from __future__ import annotations

from pathlib import Path

import click

from armtempo.cli import chosen, options


@click.command()
@options.port
@options.log_traffic
def command(port: str | None, log_traffic: Path | None) -> None:
    """Clear the pending fault, once its cause is gone."""
    from armtempo.robot.stored_motion import fault_name

    with chosen.board(port, log_traffic) as board:
        before = board.status()
        board.clear()
        after = board.status()
    if not before.fault:
        click.echo("no fault was pending")
    else:
        click.echo(f"cleared: {fault_name(before.fault)}; the board is {after.state}")
