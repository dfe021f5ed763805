"""``armtempo rename``: another name for a stored motion."""

from __future__ import annotations

from pathlib import Path

import click

from armtempo.cli import chosen, options, results


@click.command()
@click.argument("old")
@click.argument("new")
@options.port
@options.log_traffic
@options.as_json
def command(old: str, new: str, port: str | None, log_traffic: Path | None, as_json: bool) -> None:
    """Give a stored motion another name.

    OLD: its name, as 'armtempo list' shows it. NEW: at most 24 of the characters a-z A-Z 0-9 - _.
    """
    with chosen.board(port, log_traffic) as board:
        board.rename(old, new)
    results.show(as_json, {"old": old, "new": new}, [f"{old} is now {new}"])
