"""``armtempo pause``: come to rest on the path, to go on later."""

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
    """Let what moves come to rest on its path; 'armtempo resume' goes on, 'armtempo stop' ends it.

    The drivers hold meanwhile. A run, its pauses counted, lasts at most 1 h 49 min.
    """
    change(port, log_traffic, Asked("pause", lambda board: board.pause(), "paused", 0.0), as_json)
