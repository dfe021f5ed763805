"""``armtempo run`` and ``fetch``: replay and record a motion, or fetch the samples of a run without a host."""

from __future__ import annotations

import time
from pathlib import Path
from types import TracebackType
from typing import Self

import click
import numpy as np
from armtempo_shared.limits import TICK_HZ

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.cli import options, programs, resolve, results, sequences
from armtempo.cli.options import BoardOptions
from armtempo.cli.results import ProgressBar
from armtempo.encoding.encoded_plan import Encoded
from armtempo.link.board_messages import Sample
from armtempo.model.plan import Plan
from armtempo.report import text_summary
from armtempo.report.run import Run
from armtempo.report.run_folder import Repetition, RunFolder
from armtempo.robot.board import Board
from armtempo.robot.recording import Watcher


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


# display
class RunProgress(Watcher):
    """Shows a run on the terminal; a context."""

    def __init__(self, where: str = "", aside: bool = False) -> None:
        """``where``: text about a virtual board; ``aside``: print to stderr."""
        self._say = results.remark if aside else results.echo
        self._where = f", on {where}" if where else ""
        self._progress = ProgressBar("moving")
        self._before = (0, 0)
        """Ticks of the last sample, and of the motion's own time."""

    def begin(self, motion: Encoded, folder: RunFolder) -> None:
        """Print the motion and its run folder."""
        self._motion = motion  # sequences are shown by their states
        self._started_s = time.monotonic()
        self._say(
            f"{motion.name}: {self._motion.trajectory.duration_s:.3f} s, into {folder.path}{self._where}"
        )

    def on_sample(self, sample: Sample, duration_s: float) -> None:
        """Show one sample."""
        time_s = sample.path_ticks / TICK_HZ  # the motion's own time
        angles = self._angles_deg(sample)
        errors = angles - self._motion.trajectory(time_s)
        signs = (joint.unit.sign for joint in self._motion.arm.driven)
        pairs = (
            f"{angle:.1f}{sign} ({error:+.2f})"
            for angle, error, sign in zip(angles, errors, signs, strict=True)
        )
        elapsed = time.monotonic() - self._started_s
        self._progress(time_s, duration_s, f"{elapsed:.0f} s{self._speed(sample)}  {'  '.join(pairs)}")

    def _speed(self, sample: Sample) -> str:
        """The speed since the previous sample, if it is not the planned one."""
        (before, path_before), self._before = self._before, (sample.ticks, sample.path_ticks)
        if sample.ticks <= before:
            return ""
        percent = round(100 * (sample.path_ticks - path_before) / (sample.ticks - before))
        return "" if percent in (99, 100, 101) else f", at {percent} %" if percent > 0 else ", paused"

    def end(self, repetition: Repetition) -> None:
        """Print how the repetition ended."""
        self._say(repetition_line(repetition))

    def _angles_deg(self, sample: Sample) -> Array:
        """Measured angles, degrees (J,); commanded angles of joints without an encoder."""
        gears, positions = self._motion.arm.transmission, sample.positions
        measured = gears.angles_of_counts(positions.counts)
        return np.where(gears.measured, measured, gears.angles_of_steps(positions.commanded_steps))

    def __enter__(self) -> Self:
        self._progress.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._progress.__exit__(kind, value, trace)


def repetition_line(done: Repetition) -> str:
    """One line about a repetition: how it ended, its duration, missing samples."""
    lost = sum(gap.number for gap in done.lost)
    missing = f", {lost} lost" if lost else ""
    state = f"{done.state} ({done.fault})" if done.fault else done.state
    return f"{done.file}: {state}, {done.duration_s:.3f} s, {done.samples} samples{missing}"
