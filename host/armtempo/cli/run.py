"""``armtempo run``: replay a motion and record what comes back."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from armtempo.cli import options
from armtempo.cli.progress import Progress

if TYPE_CHECKING:
    from armtempo.link import Board
    from armtempo.pipeline import Motion
    from armtempo.record import Repetition


@click.command()
@click.argument("what")
@click.option("--repeat", type=click.IntRange(1, 99), default=1, show_default=True, help="Repetitions.")
@options.out
@options.arm
@options.port
@options.log_traffic
def command(
    what: str, repeat: int, out: Path, arm_path: Path | None, port: str, log_traffic: Path | None
) -> None:
    """Replay a motion and record it.

    WHAT is a trajectory file or the name of a motion on the board; the samples go into a new run folder.
    The arm must be homed ('armtempo home') and stand where the motion begins ('armtempo goto'); a virtual
    board sees to that itself. Between repetitions the arm returns along the same path. Ctrl-C brakes.
    """
    with options.board(port, log_traffic) as board:
        motion = _motion(board, what, arm_path)
        replay(board, port, motion, repeat, out)


def _motion(board: Board, what: str, arm_path: Path | None) -> Motion:
    from armtempo import operate, pipeline

    path = Path(what)
    if path.suffix == ".json" or path.exists():
        motion = pipeline.from_file(path, options.load_arm(arm_path) if arm_path else None)
        operate.configure(board, motion.arm, replace=True)
        return motion
    arm = options.load_arm(arm_path)
    operate.configure(board, arm, replace=arm_path is not None)
    return pipeline.from_board(board, what, arm)


def _told(done: Repetition) -> str:
    lost = sum(count for _, count in done.lost)
    missing = f", {lost} lost" if lost else ""
    return f"{done.file}: {done.state}, {done.duration_s:.3f} s, {done.samples} samples{missing}"


def replay(board: Board, port: str, motion: Motion, repeat: int, out: Path) -> Path:
    """Bring the arm to the start, replay, record, tell; gives the run folder."""
    from armtempo import pipeline
    from armtempo.interrupt import StopRequest

    with StopRequest() as stop:
        pipeline.bring_to_start(board, port, motion, stop)
        folder = pipeline.new_run(out, motion, port, board)
        click.echo(f"{motion.name}: {motion.trajectory.duration_s:.3f} s, into {folder.path}")
        with Progress("moving") as progress:
            for done in pipeline.repeat(board, motion, folder, repeat, stop, progress):
                click.echo(_told(done))
    if stop.wanted:
        raise KeyboardInterrupt
    for line in pipeline.results(motion, folder.repetitions[-1]):
        click.echo(line)
    return folder.path
