"""``armtempo resume``: go on after a pause."""

from __future__ import annotations

from pathlib import Path

import click
from armtempo_shared.messages import RESUME

from armtempo.cli import options
from armtempo.cli.speed import change


@click.command()
@options.port
@options.log_traffic
def command(port: str | None, log_traffic: Path | None) -> None:
    """Go on along the path at the speed before the pause."""
    change(port, log_traffic, RESUME, "going on")
