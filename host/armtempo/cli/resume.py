"""``armtempo resume``: go on after a pause."""

from __future__ import annotations

from pathlib import Path

import click

from armtempo.cli import options
from armtempo.cli.speed import Asked, change


@click.command()
@options.port
@options.log_traffic
@options.as_json
def command(port: str | None, log_traffic: Path | None, as_json: bool) -> None:
    """Go on along the path at the speed before the pause."""
    change(port, log_traffic, Asked("resume", lambda board: board.resume(), "going on"), as_json)
