"""``armtempo clear``: clear a fault."""

from __future__ import annotations

from pathlib import Path

import click

from armtempo.cli import chosen, options, results


@click.command()
@options.port
@options.log_traffic
@options.as_json
def command(port: str | None, log_traffic: Path | None, as_json: bool) -> None:
    """Clear the pending fault, once its cause is gone."""
    from armtempo.robot.stored_motion import fault_name

    with chosen.board(port, log_traffic) as board:
        before = board.status()
        board.clear()
        after = board.status()
    fault = fault_name(before.fault) if before.fault else None
    line = f"cleared: {fault}; the board is {after.state}" if fault else "no fault was pending"
    results.show(as_json, {"cleared": fault, "state": after.state}, [line])
