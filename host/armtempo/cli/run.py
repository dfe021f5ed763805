"""``armtempo run``: replay a motion and record what comes back."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from armtempo.basics.errors import InputError
from armtempo.cli import chosen, options, results, sequences

if TYPE_CHECKING:
    from armtempo.model.plan import Plan
    from armtempo.records.encoded_motion import EncodedMotion
    from armtempo.robot.board import Board
    from armtempo.robot.run import Run


@click.command()
@click.argument("what", shell_complete=options.files)
@click.option("--repeat", type=click.IntRange(1, 99), default=1, show_default=True, help="Repetitions.")
@click.option("--live", is_flag=True, help="Open a window that follows the run (matplotlib and a display).")
@options.speed
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
    percent: float,
    force: bool,
    out: Path | None,
    arm_path: Path | None,
    replace_arm: bool,
    altered: bool,
    port: str | None,
    log_traffic: Path | None,
    as_json: bool,
) -> None:
    """Replay a motion and record it, or run a sequence.

    WHAT: a trajectory file or the name of a motion on the board, or a planned sequence or the name of one on the
    board, whose step and cycle are shown. The samples go into a new run folder.
    The arm must be homed ('armtempo home') and stand where the motion begins ('armtempo goto'); a virtual
    board sees to that itself. Between repetitions the arm returns along the same path. Ctrl-C brakes, and so
    does 'armtempo stop' in another terminal; 'armtempo speed', 'pause' and 'resume' work there too.
    """
    from armtempo.model.sequence_plan import is_sequence_plan

    if chosen.is_file(what) and is_sequence_plan(Path(what)):
        only_for_motions(repeat, live)
        sequence = chosen.load_sequence_plan(Path(what), arm_path)
        with chosen.board(port, log_traffic, sequence.arm) as board:
            board.configure(sequence.arm, replace=replace_arm)
            results.teller(as_json)(f"arm: {chosen.words(sequence.arm)}")
            board.speed(percent / 100)
            sequences.run_and_tell(board, sequence, force, chosen.runs(out), as_json)
        return
    plan = chosen.load_plan(Path(what), arm_path, altered) if chosen.is_file(what) else None
    named = plan.arm if plan else chosen.named_arm(arm_path)
    with chosen.board(port, log_traffic, named) as board:
        arm = chosen.arm_of_board(board, named)
        board.configure(arm, replace=replace_arm)
        results.teller(as_json)(f"arm: {chosen.words(arm)}")
        motion = board.upload(plan, replace=force) if plan else what
        board.speed(percent / 100)
        if isinstance(motion, str) and _is_sequence(board, motion):
            only_for_motions(repeat, live)
            sequences.run_and_tell(board, motion, False, chosen.runs(out), as_json)
            return
        run_and_tell(board, motion, repeat, chosen.runs(out), live, as_json)


def only_for_motions(repeat: int, live: bool) -> None:
    """InputError for what a sequence has not: repetitions of its own, a plot."""
    for name, given in (("--repeat", repeat != 1), ("--live", live)):
        if given:
            raise InputError(
                f"{name}: a sequence has no such thing", "leave it out; repeat is a step of the sequence"
            )


def _is_sequence(board: Board, name: str) -> bool:
    found = board.client.find(name)
    return found is not None and found.sequence


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
    results.show(as_json, run.to_json(), text_summary.result_lines(run.results))
    return run
