"""``armtempo run``: replay a motion and record what comes back."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from armtempo.cli import options

if TYPE_CHECKING:
    from armtempo.link import Board
    from armtempo.pipeline import Motion
    from armtempo.runs.run_folder import Repetition


@click.command()
@click.argument("what")
@click.option("--repeat", type=click.IntRange(1, 99), default=1, show_default=True, help="Repetitions.")
@click.option("--live", is_flag=True, help="Open a window that follows the run (matplotlib and a display).")
@options.out
@options.arm_of_file
@options.port
@options.log_traffic
def command(
    what: str, repeat: int, live: bool, out: Path, arm_path: Path | None, port: str, log_traffic: Path | None
) -> None:
    """Replay a motion and record it.

    WHAT is a trajectory file or the name of a motion on the board; the samples go into a new run folder.
    The arm must be homed ('armtempo home') and stand where the motion begins ('armtempo goto'); a virtual
    board sees to that itself. Between repetitions the arm returns along the same path. Ctrl-C brakes.
    """
    from armtempo import pipeline
    from armtempo.robot import operate

    file = motion_file(what)
    motion = pipeline.from_file(file, options.load_arm(arm_path) if arm_path else None) if file else None
    arm = motion.arm if motion else options.load_arm(arm_path)
    with options.board(port, log_traffic, arm) as board:
        operate.configure(board, arm, replace=motion is not None or arm_path is not None)
        replay(board, port, motion or pipeline.from_board(board, what, arm), repeat, out, live)


def motion_file(what: str) -> Path | None:
    """The trajectory file that is meant; None for a name on the board."""
    path = Path(what)
    return path if path.suffix == ".json" or path.is_file() else None


def told(done: Repetition) -> str:
    """One line on a repetition."""
    lost = sum(count for _, count in done.lost)
    missing = f", {lost} lost" if lost else ""
    state = f"{done.state} ({done.fault})" if done.fault else done.state
    return f"{done.file}: {state}, {done.duration_s:.3f} s, {done.samples} samples{missing}"


def replay(board: Board, port: str, motion: Motion, repeat: int, out: Path, live: bool = False) -> Path:
    """Upload, bring the arm to the start, replay, record, tell; gives the run folder."""
    from armtempo import pipeline
    from armtempo.cli.live import Live
    from armtempo.robot.stop_request import StopRequest

    with StopRequest() as stop:
        pipeline.prepare(board, port, motion, stop)
        folder = pipeline.new_run(out, motion, port, board)
        click.echo(f"{motion.name}: {motion.trajectory.duration_s:.3f} s, into {folder.path}")
        with Live(motion, window=live) as watch:
            for done in pipeline.repeat(board, motion, folder, repeat, stop, watch):
                click.echo(told(done))
    if stop.wanted:
        raise KeyboardInterrupt
    for line in pipeline.results(motion, folder.repetitions[-1]):
        click.echo(line)
    return folder.path
