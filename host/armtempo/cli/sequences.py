"""Sequences on the terminal: times of a planned sequence, progress of a running one."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import asdict
from itertools import groupby
from pathlib import Path
from typing import Any

import click
from armtempo_shared.sequence import END, MOVE, REPEAT, WAIT

import armtempo
from armtempo.basics.atomic_file import check_not_input
from armtempo.basics.errors import ArmtempoError, InputError, LinkError
from armtempo.basics.text import aligned
from armtempo.cli import resolve, results
from armtempo.cli.results import ProgressBar
from armtempo.cli.state import counted
from armtempo.encoding import flash_use
from armtempo.encoding.encoded_plan import Encoded
from armtempo.link.board_messages import SequenceState
from armtempo.link.follow import where
from armtempo.model.leg import SequenceRow
from armtempo.model.plan import PAUSE_S, Plan, Share
from armtempo.model.sequence import Sequence, arm_named
from armtempo.model.steps import position, whole_cycles
from armtempo.report import text_summary
from armtempo.robot.board import Board
from armtempo.robot.stop_request import Stopped


def plan(file: Path, arm_path: Path | None, output: Path | None, force: bool, as_json: bool) -> None:
    """Plan a sequence file, print its times, and write it."""
    named = arm_path or arm_named(file)
    arm = resolve.load_arm(named)
    sequence = Sequence.load(file, arm)
    target = output or Path(f"{sequence.name}.json")
    check_not_input(target, (file, arm.source))
    with ProgressBar("planning") as progress:
        planned = armtempo.plan_sequence(arm, sequence, progress)
    planned.save(target, force)
    found = [f"arm: {resolve.describe_arm(arm)}", *lines(planned), f"written: {target}"]
    results.show(as_json, {"file": str(target), **values(planned)}, found)


def refuse_job_options(options: dict[str, Any]) -> None:
    """Raise InputError for an option that changes a job: a sequence has none."""
    given = sorted(name for name, value in options.items() if value not in (None, False))
    if given:
        raise InputError(
            f"--{given[0].replace('_', '-')}: not for a sequence",
            "give it in the job files that the sequence runs",
        )


def values(planned: Plan) -> dict[str, Any]:
    """The content of ``lines`` as plain values."""
    cycles = [
        {"step": cycle.step, "times": cycle.times or None, **_share(cycle.share)} for cycle in planned.cycles
    ]
    return {
        "name": planned.name,
        "arm": planned.arm.name,
        "steps": [
            {"step": row.step, "does": row.words, "duration_s": _duration_s(planned, row)}
            for row in planned.rows
        ],
        "cycles": cycles,
        "total": None if planned.total is None else _share(planned.total),
        "pause_s": PAUSE_S,
        "flash_bytes": flash_use.of_plan(planned),
        "notes": list(planned.notes),
    }


def _share(share: Share) -> dict[str, Any]:
    return {"duration_s": share.total_s, **asdict(share)}


def _duration_s(planned: Plan, row: SequenceRow) -> float | None:
    """Duration of a row; None for a row without one."""
    if row.op == MOVE:
        return float(planned.legs[row.number].trajectory.duration_s)
    return row.amount / 1000 if row.op == WAIT else None


def lines(planned: Plan) -> list[str]:
    """Each row with its time, then the times of the cycles and of the whole sequence."""
    rows, depth = [("step", "", "seconds")], 0
    for row in planned.rows:
        depth -= row.op == END
        taken = _duration_s(planned, row)
        rows.append((str(row.step), "  " * depth + row.words, "" if taken is None else f"{taken:.3f}"))
        depth += row.op == REPEAT
    width = max(len(words) for _, words, _ in rows)
    found = aligned([(step, words.ljust(width), time) for step, words, time in rows], (4, width + 2, 9))
    for (step, times), cycles in groupby(planned.cycles, lambda cycle: (cycle.step, cycle.times)):
        shares = [cycle.share for cycle in cycles]
        if len(shares) == 1:
            often = f"{times} times" if times else "for ever"
            found.append(f"cycle (step {step}, {often}): {_made_of(shares[0])}")
        else:  # of a pallet, each place in its own time
            each_s = [share.total_s for share in shares]
            found.append(
                f"cycle (step {step}, {len(shares)} times): {min(each_s):.3f} to {max(each_s):.3f} s"
            )
    if planned.total is not None:
        found.append(f"in all: {_made_of(planned.total)}")
    found.extend(f"note: {note}" for note in planned.notes)
    found.extend(text_summary.torque_lines(planned.loaded_legs))
    found.append(f"on the board: {len(planned.legs)} motions, {flash_use.words(planned)}")
    found.append(f"pause between two motions: about {PAUSE_S:g} s; waits for inputs are not counted")
    return found


def _made_of(share: Any) -> str:
    pauses = share.total_s - share.motion_s - share.wait_s
    return (
        f"{share.total_s:.3f} s = {share.motion_s:.3f} s in {share.motions} motions + {share.wait_s:.3f} s waits + "
        f"{pauses:.3f} s pauses"
    )


class StateLine:
    """A watcher that keeps the state of a running sequence or program on the last line of a terminal.

    Without a terminal it prints a line for each finished cycle of a sequence.
    """

    def __init__(
        self, describe: Callable[[SequenceState], str], say: Callable[[str], object] | None = None
    ) -> None:
        self._describe = describe
        self._say = say
        self._cycle = 0
        self.last: SequenceState | None = None

    def __call__(self, state: SequenceState) -> None:
        self.last = state
        if sys.stderr.isatty():
            click.echo(f"\r\x1b[K{self._describe(state)}", nl=False, err=True)
        elif state.cycle != self._cycle and self._say is not None:
            self._say(f"{whole_cycles(state.cycle)} finished")
        self._cycle = state.cycle

    def clear(self) -> None:
        """Remove the line, for another text."""
        if sys.stderr.isatty():
            click.echo("\r\x1b[K", nl=False, err=True)


def run_and_report(
    board: Board, sequence: Plan | Encoded | str, out: Path | None, as_json: bool = False
) -> SequenceState:
    """Run a sequence, recorded in a run folder in ``out`` (None: not recorded); print its progress and its
    end.

    ``as_json``: print the end as JSON. Exit code 1 if the wait for an input timed out.
    """
    say = results.progress_printer(as_json)
    rows = () if isinstance(sequence, str) else sequence.rows

    def describe(state: SequenceState) -> str:
        doing = f": {rows[state.row].words}" if state.row < len(rows) else ""
        return f"{position(state.step, state.cycle)}{doing}"

    shown = StateLine(describe, say)
    try:
        end = board.run_sequence(sequence, shown, out=out)
    except Stopped:
        shown.clear()
        say(f"stopped {where(board.client.sequence())}{counted(board.counters)}")
        raise
    except LinkError:
        shown.clear()
        if shown.last is not None:
            say(f"last known state: {where(shown.last)}")
        raise
    finally:
        shown.clear()
        if (recorded := board.last_sequence) is not None and out is not None:
            say(f"recorded in {recorded.path}")
    if end.ending == "timed_out":
        raise ArmtempoError(
            f"an input did not change in time {where(end)}",
            "find the cause, 'armtempo goto' its start, run it again",
        )
    result = _as_json(end, board, recorded.path if recorded else None)
    results.show(as_json, result, [f"{end.ending} after {whole_cycles(end.cycle)}{counted(board.counters)}"])
    return end


def _as_json(end: SequenceState, board: Board, folder: Path | None) -> dict[str, Any]:
    """The end as plain values."""
    return {
        "name": end.name,
        "folder": str(folder) if folder else None,
        "ending": end.ending,
        "step": end.step,
        "cycles": end.cycle,
        "counters": board.counters,
    }
