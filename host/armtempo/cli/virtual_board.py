"""``armtempo virtual-board``: a virtual board for other programs to open."""

from __future__ import annotations

import time
from pathlib import Path

import click

from armtempo.basics.errors import LinkError
from armtempo.cli import options, resolve
from armtempo.simulator import LaunchOptions, launch

_LOOK_S = 0.5


@click.command("virtual-board")
@click.option(
    "--flash",
    type=options.FOLDER,
    help="Folder used as the board's flash; created if missing. Default: a temporary one.",
)
@click.option("--real-time", is_flag=True, help="Run motions in real time instead of as fast as possible.")
@click.option(
    "--edge-log",
    type=options.FILE,
    help="Write every pin edge with its time to this file.",
)
@click.option("--interpreter", help="MicroPython or Python that runs it. Default: micropython if found.")
@click.option(
    "--deployed",
    is_flag=True,
    help="Run the program in the flash (installed by 'armtempo deploy') instead of this installation's.",
)
@options.arm
@click.option("--ideal", is_flag=True, help="Use ideal motors, as without an arm file.")
@click.option(
    "--seed", default=0, show_default=True, help="Seed of the board's id and of its random deviations."
)
def virtual_board(
    flash: Path | None,
    real_time: bool,
    edge_log: Path | None,
    interpreter: str | None,
    deployed: bool,
    arm_path: Path | None,
    ideal: bool,
    seed: int,
) -> None:
    """Start a virtual board, and run it until Ctrl-C.

    The port can be opened like a serial device, by armtempo (--port) and by any other program. Its motors are
    those of the arm file; without an arm file they are ideal and fit any arm.
    """
    wanted = LaunchOptions(
        flash,
        virtual_time=not real_time,
        edge_log=edge_log,
        interpreter=interpreter,
        arm=None if ideal else resolve.named_arm(arm_path),
        seed=seed,
        deployed=deployed,
    )
    with launch(wanted) as board:
        click.echo(board.port)
        while board.running():
            time.sleep(_LOOK_S)
        tail = board.log().strip().splitlines()[-1:]
        raise LinkError(
            f"the virtual board ended: {' '.join(tail) or 'without a message'}",
            "start it again; the same --flash keeps its files",
        )
