"""Sequences on the terminal: what a planned one takes, and where one that runs stands."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from armtempo.cli import chosen
from armtempo.cli.progress import ProgressBar
from armtempo.errors import InputError
from armtempo.formats.text_table import aligned

if TYPE_CHECKING:
    from armtempo.link.board_messages import SequenceState
    from armtempo.model.sequence_plan import SequencePlan
    from armtempo.robot.board import Board


def plan(file: Path, arm_path: Path | None, output: Path | None, force: bool) -> None:
    """Plan a sequence file, say what its time is made of, and write it."""
    import armtempo
    from armtempo.formats.atomic_file import check_not_input
    from armtempo.model import sequence_file
    from armtempo.model.sequence import Sequence

    named = arm_path or sequence_file.arm_named(file)
    arm = chosen.load_arm(named)
    sequence = Sequence.load(file, arm)
    target = output or Path(f"{sequence.name}.json")
    check_not_input(target, (file, arm.source))
    with ProgressBar("planning") as progress:
        planned = armtempo.plan_sequence(arm, sequence, progress)
    planned.save(target, force)
    click.echo(f"arm: {chosen.words(arm)}")
    for line in lines(planned):
        click.echo(line)
    click.echo(f"written: {target}")


def refuse_job_options(options: dict[str, Any]) -> None:
    """InputError where an option changes the job, and there is none."""
    given = sorted(name for name, value in options.items() if value not in (None, False))
    if given:
        raise InputError(
            f"--{given[0].replace('_', '-')}: a sequence has no such setting",
            "give it in the job files that the sequence runs",
        )


def lines(planned: SequencePlan) -> list[str]:
    """Each row with its time, the cycle, the whole."""
    from armtempo_shared.sequence import END, MOVE, REPEAT, WAIT

    from armtempo.model.sequence_plan import PAUSE_S

    rows, depth = [("step", "", "seconds")], 0
    for row in planned.rows:
        depth -= row.op == END
        taken = (
            planned.legs[row.number].duration_s
            if row.op == MOVE
            else row.amount / 1000
            if row.op == WAIT
            else None
        )
        rows.append((str(row.step), "  " * depth + row.words, "" if taken is None else f"{taken:.3f}"))
        depth += row.op == REPEAT
    width = max(len(words) for _, words, _ in rows)
    found = aligned([(step, words.ljust(width), time) for step, words, time in rows], (4, width + 2, 9))
    for cycle in planned.cycles:
        times = f"{cycle.times} times" if cycle.times else "for ever"
        found.append(f"cycle (step {cycle.step}, {times}): {_made_of(cycle.share)}")
    if planned.total is not None:
        found.append(f"in all: {_made_of(planned.total)}")
    found.append(f"pause between two motions: {PAUSE_S:g} s; waits for inputs are not counted")
    return found


def _made_of(share: Any) -> str:
    pauses = share.total_s - share.motion_s - share.wait_s
    return (
        f"{share.total_s:.3f} s = {share.motion_s:.3f} s in {share.motions} motions + {share.wait_s:.3f} s waits + "
        f"{pauses:.3f} s pauses"
    )


class Shown:
    """A watcher that keeps one line on a terminal, or says each new cycle elsewhere."""

    def __init__(self, planned: SequencePlan | None, aside: bool = False) -> None:
        self._rows = planned.rows if planned else ()
        self._aside = aside  # not where results go
        self._cycle = -1
        self.last: SequenceState | None = None

    def __call__(self, state: SequenceState) -> None:
        """Show where the sequence stands."""
        self.last = state
        doing = f": {self._rows[state.row].words}" if state.row < len(self._rows) else ""
        if sys.stderr.isatty():
            click.echo(f"\r\x1b[Kcycle {state.cycle}, step {state.step}{doing}", nl=False, err=True)
        elif state.cycle != self._cycle:
            click.echo(f"cycle {state.cycle}, step {state.step}{doing}", err=self._aside)
        self._cycle = state.cycle

    def close(self) -> None:
        """End the line."""
        if sys.stderr.isatty():
            click.echo(err=True)


def run_and_tell(
    board: Board, sequence: SequencePlan | str, replace: bool, out: Path | None, as_json: bool = False
) -> SequenceState:
    """Run a sequence into a run folder below ``out`` (None: nowhere), print where it stands and how it ended.

    ``as_json``: the end as JSON. Exit code 1 where an input did not come.
    """
    from armtempo.cli.state import counted
    from armtempo.errors import ArmtempoError, LinkError
    from armtempo.robot.sequence_run import cycles, where
    from armtempo.robot.stop_request import Stopped

    shown = Shown(sequence if not isinstance(sequence, str) else None, aside=as_json)
    try:
        end = board.run_sequence(sequence, shown, replace=replace, out=out)
    except Stopped:
        shown.close()
        click.echo(f"stopped {where(board.client.sequence())}{counted(board.counters)}", err=as_json)
        raise
    except LinkError:
        shown.close()
        if shown.last is not None:
            click.echo(f"last heard of {where(shown.last)}", err=as_json)
        raise
    finally:
        if (recorded := board.last_sequence) is not None and out is not None:
            click.echo(f"recorded in {recorded.path}", err=as_json)
    shown.close()
    if end.ending == "timed_out":
        raise ArmtempoError(
            f"an input did not come in time {where(end)}", "see why, 'armtempo goto' its start, run it again"
        )
    if as_json:
        click.echo(json.dumps(_as_json(end, board, recorded.path if recorded else None)))
    else:
        click.echo(f"{end.ending} after {cycles(end)}{counted(board.counters)}")
    return end


def _as_json(end: SequenceState, board: Board, folder: Path | None) -> dict[str, Any]:
    """How it ended, for other programs."""
    return {
        "name": end.name,
        "folder": str(folder) if folder else "",
        "ending": end.ending,
        "step": end.step,
        "cycle": end.cycle,
        "counters": board.counters,
    }
