"""``armtempo remove``: forget stored motions."""

from __future__ import annotations

from pathlib import Path

import click

from armtempo.cli import chosen, options, results


@click.command()
@click.argument("names", nargs=-1, required=True)
@options.port
@options.log_traffic
@options.as_json
def command(names: tuple[str, ...], port: str | None, log_traffic: Path | None, as_json: bool) -> None:
    """Remove stored motions from the board.

    NAMES: as 'armtempo list' shows them.
    """
    with chosen.board(port, log_traffic) as board:
        for name in names:
            board.remove(name)
            results.teller(as_json)(f"{name}: removed")
    if as_json:
        results.show_json({"removed": names})
