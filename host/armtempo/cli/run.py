"""``armtempo run``: replay a motion and record what comes back."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from armtempo.cli import options

if TYPE_CHECKING:
    from armtempo.model.plan import Plan
    from armtempo.robot.board import Board
    from armtempo.robot.run import Run


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
    plan = options.load_plan(what, arm_path)
    arm = plan.arm if plan else options.load_arm(arm_path)
    with options.board(port, log_traffic, arm) as board:
        board.configure(arm, replace=plan is not None or arm_path is not None)
        run_and_tell(board, plan or what, repeat, out, live)


def run_and_tell(board: Board, motion: Plan | str, repeat: int, out: Path, live: bool = False) -> Run:
    """Run a plan, or the motion of that name, and print what happens and what became of each joint."""
    from armtempo.cli.live import Live
    from armtempo.report import text_summary

    with Live(window=live) as watcher:
        run = board.run(motion, repeat, out, watcher=watcher)
    for line in text_summary.result_lines(run.results):
        click.echo(line)
    return run
