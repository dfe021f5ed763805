"""``armtempo flash``: put a firmware with the board program on a board."""

from __future__ import annotations

from pathlib import Path

import click

from armtempo.cli import options, results
from armtempo.cli.progress import ProgressBar
from armtempo.project.settings import PORT, ProjectSettings


@click.command()
@click.option(
    "--image",
    "given",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="The zip file of a release, or a folder that 'armtempo firmware' made. Without it the only one here.",
)
@click.option("--port", metavar="PORT", help="Where the board answers now, if it runs MicroPython.")
@click.option(
    "--tool",
    type=click.Choice(["dfu-util", "st-flash"]),
    help="What flashes: over USB, or through an ST-LINK; without it the one that is installed.",
)
@options.as_json
def command(given: Path | None, port: str | None, tool: str | None, as_json: bool) -> None:
    """Put MicroPython with the board program in it on a board; 'armtempo deploy' comes next.

    A board that runs MicroPython is put in its bootloader first, which is refused while it moves; a board that
    is there already, or has an ST-LINK, needs no port. What was written is read back and compared. Files in the
    board's flash are kept.
    """
    from armtempo.deploy.firmware import image
    from armtempo.deploy.firmware.write import flash

    chosen = given or image.find(Path())
    found = ProjectSettings().get(PORT, port).value or None
    with ProgressBar("flashing") as progress:
        flash(chosen, found, tool, results.teller(as_json), progress)
    results.show(
        as_json, {"image": str(chosen), "port": found}, ["flashed; the start files are next: armtempo deploy"]
    )
