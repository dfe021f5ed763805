"""``armtempo run`` and ``fetch``: replay and record a motion, or fetch the samples of a run without a host."""

from __future__ import annotations

from pathlib import Path

import click

from armtempo.basics.errors import InputError
from armtempo.cli import options, programs, resolve, results, sequences
from armtempo.cli.options import BoardOptions
from armtempo.cli.run_progress import RunProgress, repetition_line
from armtempo.encoding.encoded_plan import Encoded
from armtempo.model.plan import Plan
from armtempo.report import text_summary
from armtempo.report.run import Run
from armtempo.robot.board import Board


@click.command("run")
@click.argument("what", shell_complete=options.files)
@click.option("--repeat", type=click.IntRange(1, 99), default=1, show_default=True, help="Repetitions.")
@options.speed
@options.force("another motion of this name on the board")
@options.out
@options.board(options.arm_of_file, options.replace_arm, options.altered)
def run(what: str, repeat: int, percent: float, force: bool, out: Path | None, given: BoardOptions) -> None:
    """Run a motion, a sequence or a program, and record it.

    WHAT: a trajectory file, a planned sequence, or the name of what is on the board. The samples
    go into a new run folder. The arm must be homed ('armtempo home') and be at the start of the motion
    ('armtempo goto'); a virtual arm is moved there first. Between repetitions the arm returns along the same
    path. Ctrl-C, or 'armtempo stop' in another terminal, brakes; 'armtempo speed', 'pause' and 'resume' work
    there too.
    """
    plan = resolve.load_plan(Path(what), given.arm_path, given.altered) if resolve.is_file(what) else None
    is_sequence = plan is not None and plan.is_sequence
    _refuse_repeat(repeat, is_sequence)
    named = plan.arm if plan else resolve.named_arm(given.arm_path)
    with resolve.board(given, named) as board:
        arm = resolve.arm_of_board(board, named)
        board.configure(arm, replace=given.replace_arm)
        results.progress_printer(given.as_json)(f"arm: {resolve.describe_arm(arm)}")
        stored = board.client.find(what) if plan is None else None
        is_program = stored is not None and stored.program
        is_sequence = is_sequence or (stored is not None and stored.sequence)
        _refuse_repeat(repeat, is_sequence or is_program)
        motion = board.upload(plan, replace=force) if plan else what
        board.speed(percent / 100)
        if is_program:
            programs.run_and_report(board, what, given.as_json)
        elif is_sequence:
            sequences.run_and_report(board, motion, resolve.runs(out), given.as_json)
        else:
            run_and_report(board, motion, repeat, resolve.runs(out), given.as_json)


def _refuse_repeat(repeat: int, has_its_own: bool) -> None:
    """Raise InputError for --repeat, which a sequence or program does not have."""
    if repeat != 1 and has_its_own:
        raise InputError(
            "--repeat: not for a sequence or program", "leave it out; it has its own repeat or loops"
        )


def run_and_report(
    board: Board,
    motion: Plan | Encoded | str,
    repeat: int,
    out: Path,
    as_json: bool = False,
) -> Run:
    """Run a motion, or the stored motion of that name, and print the progress and the result of each joint.

    ``as_json``: print the result as JSON, and the progress to stderr.
    """
    virtual = "a virtual board" if board.info.virtual else ""
    with RunProgress(virtual, aside=as_json) as watcher:
        run = board.run(motion, repeat, out, watcher=watcher)
    results.show(as_json, run.to_json(), text_summary.result_lines(run.results))
    return run


@click.command("fetch")
@click.argument("what", required=False, shell_complete=options.files)
@options.out
@options.board(options.arm_of_file, options.altered)
def fetch(what: str | None, out: Path | None, given: BoardOptions) -> None:
    """Fetch the samples of the last run from the board.

    WHAT: the motion of that run: a trajectory file, or the name of a motion on the board; default: the motion
    that the button starts. Waits for the end of a motion that still runs. The samples can be fetched once.
    """
    plan = (
        resolve.load_plan(Path(what), given.arm_path, given.altered)
        if what and resolve.is_file(what)
        else None
    )
    if plan is not None and plan.is_sequence:
        raise InputError(f"{what}: the samples of a sequence are not kept", "record it with 'armtempo run'")
    named = plan.arm if plan else resolve.named_arm(given.arm_path)
    with resolve.board(given, named) as board:
        board.configure(resolve.arm_of_board(board, named))
        run = board.fetch(plan or what, resolve.runs(out))
        lines = [f"{run.name}: {run.path}", repetition_line(run.entries[-1])]
        results.show(given.as_json, run.to_json(), lines)
