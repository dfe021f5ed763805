"""``armtempo firmware`` and ``flash``: MicroPython with the board program built in."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from armtempo.basics.errors import InputError
from armtempo.basics.settings import PORT, ProjectSettings
from armtempo.cli import options, results
from armtempo.cli.results import ProgressBar
from armtempo.deploy import changes
from armtempo.deploy.firmware import build, checkout, frozen, image, write
from armtempo.deploy.firmware.image import Image


@click.command("firmware")
@click.option(
    "--board",
    metavar="NAME",
    help="STM32F4DISC, OLIMEX_H407, VCC_GND_F407ZG, another board of MicroPython with an STM32F405 or "
    "F407, or a folder that defines one.",
)
@click.option(
    "--micropython",
    type=options.FOLDER,
    metavar="DIR",
    help="A checkout of MicroPython with its submodules.",
)
@click.option(
    "--out",
    type=options.PATH,
    metavar="FOLDER",
    help="New folder for the firmware; default: firmware-NAME here.",
)
@options.folder(
    "--program",
    help="Only write the program and a manifest.py to FOLDER, for your own build.",
)
@options.as_json
def firmware(
    board: str | None,
    micropython: Path | None,
    out: Path | None,
    program: Path | None,
    as_json: bool,
) -> None:
    """Build a MicroPython firmware with the board program in it.

    Needs make, gcc and arm-none-eabi-gcc; if one is missing, the command that installs it is printed.
    """
    if program is not None:
        frozen.write(program)
        manifest = program.resolve() / frozen.MANIFEST
        line = f"written: {program}; for MicroPython's make: FROZEN_MANIFEST={manifest}"
        results.show(as_json, {"folder": str(program), "manifest": str(manifest)}, [line])
        return
    if board is None or micropython is None:
        raise InputError(
            "--board and --micropython are needed",
            f"give both; a checkout of MicroPython: {checkout.how_to_get(micropython or Path('micropython'))}",
        )
    folder = out or Path(f"firmware-{Path(board).name}")
    with ProgressBar("building") as progress:
        made = build.build(micropython, board, folder, progress)
    say = results.progress_printer(as_json)
    say(
        f"{folder}: MicroPython {made.micropython} for {made.machine}, with the program {made.program_crc:08x}"
    )
    if changes.lacks_pins(made.machine):
        results.echo(f"it cannot drive an arm: {changes.NO_PINS}; {changes.MORE_PINS}", err=True)
    say(f"next: armtempo flash --image {folder}, then armtempo deploy")
    if as_json:
        results.show_json({"folder": str(folder), **_values(made)})


def _values(made: Image) -> dict[str, Any]:
    return {
        "micropython": made.micropython,
        "machine": made.machine,
        "program_crc": made.program_crc,
        "can_drive_an_arm": not changes.lacks_pins(made.machine),
    }


@click.command("flash")
@click.option(
    "--image",
    "given",
    type=options.PATH,
    metavar="FILE",
    help="The folder that 'armtempo firmware' made, or a zip file of it. Default: the only one in this folder.",
)
@click.option("--port", metavar="PORT", help="The board's present port, if it runs MicroPython.")
@click.option(
    "--tool",
    type=click.Choice(["dfu-util", "st-flash"]),
    help="How to flash: over USB, or through an ST-LINK; default: whichever is installed.",
)
@options.as_json
def flash(given: Path | None, port: str | None, tool: str | None, as_json: bool) -> None:
    """Flash MicroPython with the board program built in.

    'armtempo deploy' comes next. A board that runs MicroPython is put into its bootloader first, unless a motion
    runs. A board in its bootloader, or with an ST-LINK, needs no port. The flash is read back and compared. Files
    on the board are kept.
    """
    chosen = given or image.find(Path())
    found = ProjectSettings().get(PORT, port).value or None
    with ProgressBar("flashing") as progress:
        write.flash(chosen, found, tool, results.progress_printer(as_json), progress)
    results.show(
        as_json,
        {"image": str(chosen), "port": found},
        ["flashed; next: armtempo deploy, which writes the start files"],
    )
