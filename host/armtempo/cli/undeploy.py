"""``armtempo undeploy``: take the board program off a board."""

from __future__ import annotations

import click

from armtempo.cli import chosen, options


@click.command()
@options.port
def command(port: str | None) -> None:
    """Take the board program off a board.

    Stored motions stay; a boot.py or main.py from before comes back.
    """
    from armtempo.deploy import undeploy

    undeploy(chosen.port(port), click.echo)
