"""``armtempo flash``: put a built firmware on a board."""

from __future__ import annotations

from pathlib import Path

import click

from armtempo.cli import options, results
from armtempo.cli.progress import ProgressBar
from armtempo.project.settings import PORT, ProjectSettings


@click.command()
@click.argument("folder", type=click.Path(path_type=Path))
@options.flash_port
@options.flash_tool
@options.as_json
def command(folder: Path, port: str | None, tool: str | None, as_json: bool) -> None:
    """Put a firmware on a board: FOLDER as 'armtempo firmware' makes it, or a release brings it.

    The board of --port is put in its bootloader first, which is refused while it moves; without --port one that
    is there already, or has an ST-LINK, is flashed. Files in its flash are kept.
    """
    found = put_on_board(folder, port, tool, as_json)
    if as_json:
        results.show_json({"folder": str(folder), "port": found})


def put_on_board(folder: Path, port: str | None, tool: str | None, as_json: bool = False) -> str | None:
    """Put the firmware in ``folder`` on the board, and say what comes next; gives the board's port, if it had one."""
    from armtempo.deploy.firmware.flash import flash

    found = ProjectSettings().get(PORT, port).value or None
    with ProgressBar("flashing") as progress:
        flash(folder, found, tool, results.teller(as_json), progress)
    results.teller(as_json)(f"flashed; the start files are next: armtempo deploy --port {found or 'PORT'}")
    return found
