"""``armtempo flash``: put a built firmware on a board."""

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
@options.flash_port
@options.flash_tool
@options.as_json
def command(given: Path | None, port: str | None, tool: str | None, as_json: bool) -> None:
    """Put MicroPython with the board program in it on a board; 'armtempo deploy' comes next.

    The board of --port is put in its bootloader first, which is refused while it moves; without --port one that
    is there already, or has an ST-LINK, is flashed. What was written is read back and compared. Files in its flash
    are kept.
    """
    from armtempo.deploy.firmware import image

    chosen = given or image.find(Path())
    found = put_on_board(chosen, port, tool, as_json)
    if as_json:
        results.show_json({"image": str(chosen), "port": found})


def put_on_board(given: Path, port: str | None, tool: str | None, as_json: bool = False) -> str | None:
    """Put a firmware on the board, and say what comes next; gives the board's port, if it had one."""
    from armtempo.deploy.firmware.flash import flash

    found = ProjectSettings().get(PORT, port).value or None
    with ProgressBar("flashing") as progress:
        flash(given, found, tool, results.teller(as_json), progress)
    results.teller(as_json)(f"flashed; the start files are next: armtempo deploy --port {found or 'PORT'}")
    return found
