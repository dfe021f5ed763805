"""``armtempo deploy``: put the board program on a board."""

from __future__ import annotations

from pathlib import Path

import click

from armtempo.cli import chosen, options, results
from armtempo.cli.progress import ProgressBar


@click.command()
@click.option("--mpy", is_flag=True, help="Compiled by mpy-cross: smaller, and quicker to start.")
@click.option(
    "--package",
    type=click.Path(file_okay=False, path_type=Path),
    metavar="FOLDER",
    help="Instead write FOLDER for 'mpremote mip install --target /flash FOLDER/package.json'.",
)
@options.arm
@options.port
@options.as_json
def command(mpy: bool, package: Path | None, arm_path: Path | None, port: str | None, as_json: bool) -> None:
    """Put the board program on a board, or bring it up to date.

    mpremote copies what differs below /flash/lib; every file is read back. A boot.py or main.py that was
    there before is kept aside. Interrupted, do it again. At the end it says which arms fit into the memory that
    is left, and whether the arm that is named does.
    """
    from armtempo.deploy import deploy
    from armtempo.deploy import package as packages
    from armtempo.robot import engine_room

    if package is not None:
        packages.write(package)
        results.show(as_json, {"package": str(package)}, [f"written: {package}"])
        return
    arm = chosen.named_arm(arm_path)
    with ProgressBar("copying") as progress:
        info = deploy(chosen.port(port), mpy, results.teller(as_json), progress)
    room = engine_room.of_board(info)
    values = {
        "board_id": info.board_id,
        "virtual": info.virtual,
        "program_crc": info.program_crc,
        "protocol": info.protocol,
        "engine_room_bytes": info.engine_room,
        "arm": arm.name if arm else None,
        "arm_fits": engine_room.Room.of_board(info).holds_arm(arm) if arm else None,
    }
    of_arm = [f"{chosen.words(arm)}: {engine_room.of_arm(arm, info)}"] if arm else []
    results.show(as_json, values, ["the board runs armtempo", *room, *of_arm])
