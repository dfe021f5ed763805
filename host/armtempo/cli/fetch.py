"""``armtempo fetch``: the samples of a run that had no host."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from armtempo.cli import options

if TYPE_CHECKING:
    from armtempo.link import Board


@click.command()
@click.argument("what", required=False)
@options.out
@options.arm_of_file
@options.port
@options.log_traffic
def command(what: str | None, out: Path, arm_path: Path | None, port: str, log_traffic: Path | None) -> None:
    """Fetch the samples that the board keeps of its last run, such as one that its button started.

    WHAT is what was run: a trajectory file, or the name of a motion on the board; without it the motion that
    the button starts. A run under way is followed to its end. The samples go into a new run folder, once.
    """
    from armtempo import pipeline
    from armtempo.cli.run import motion_file, told
    from armtempo.robot import operate

    file = motion_file(what) if what else None
    motion = pipeline.from_file(file, options.load_arm(arm_path) if arm_path else None) if file else None
    arm = motion.arm if motion else options.load_arm(arm_path)
    with options.board(port, log_traffic, arm) as board:
        operate.configure(board, arm, replace=False)
        motion = motion or pipeline.from_board(board, what or _default(board), arm)
        folder, repetition = pipeline.fetch(board, port, motion, out)
        click.echo(f"{motion.name}: {folder.path}")
        click.echo(told(repetition))


def _default(board: Board) -> str:
    from armtempo.errors import InputError

    for entry in board.stored():
        if entry.default:
            return entry.name
    raise InputError("the board's button starts nothing: name the motion that was run")
