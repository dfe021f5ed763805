"""``armtempo run``: replay a motion and record what comes back."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

from armtempo.cli import chosen, options

if TYPE_CHECKING:
    from armtempo.model.plan import Plan
    from armtempo.records.encoded_motion import EncodedMotion
    from armtempo.robot.board import Board
    from armtempo.robot.run import Run


@click.command()
@click.argument("what")
@click.option("--repeat", type=click.IntRange(1, 99), default=1, show_default=True, help="Repetitions.")
@click.option("--live", is_flag=True, help="Open a window that follows the run (matplotlib and a display).")
@options.force("another motion that the board keeps under this one's name")
@options.out
@options.arm_of_file
@options.replace_arm
@options.altered
@options.port
@options.log_traffic
@options.as_json
def command(
    what: str,
    repeat: int,
    live: bool,
    force: bool,
    out: Path | None,
    arm_path: Path | None,
    replace_arm: bool,
    altered: bool,
    port: str | None,
    log_traffic: Path | None,
    as_json: bool,
) -> None:
    """Replay a motion and record it.

    WHAT is a trajectory file or the name of a motion on the board; the samples go into a new run folder.
    The arm must be homed ('armtempo home') and stand where the motion begins ('armtempo goto'); a virtual
    board sees to that itself. Between repetitions the arm returns along the same path. Ctrl-C brakes, and so
    does 'armtempo stop' in another terminal.
    """
    plan = chosen.load_plan(Path(what), arm_path, altered) if chosen.is_file(what) else None
    named = plan.arm if plan else chosen.named_arm(arm_path)
    with chosen.board(port, log_traffic, named) as board:
        arm = chosen.arm_of_board(board, named)
        board.configure(arm, replace=replace_arm)
        say = chosen.tell if as_json else click.echo
        say(f"arm: {chosen.words(arm)}")
        motion = board.upload(plan, replace=force) if plan else what
        run_and_tell(board, motion, repeat, chosen.runs(out), live, as_json)


def run_and_tell(
    board: Board,
    motion: Plan | EncodedMotion | str,
    repeat: int,
    out: Path,
    live: bool = False,
    as_json: bool = False,
) -> Run:
    """Run a motion, or the stored one of that name, and print what happens and what became of each joint.

    ``as_json``: the result as JSON, what happens on the other stream.
    """
    from armtempo.cli.live import Live
    from armtempo.report import text_summary

    virtual = chosen.virtual_words(board.port) if board.info.virtual else ""
    with Live(window=live, where=virtual, aside=as_json) as watcher:
        run = board.run(motion, repeat, out, watcher=watcher)
    if as_json:
        click.echo(json.dumps(run.to_json()))
        return run
    for line in text_summary.result_lines(run.results):
        click.echo(line)
    return run
