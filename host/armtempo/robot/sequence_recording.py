"""Recording a running sequence: its rows and samples, from the board's events, into a run folder."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from armtempo_shared import sequence, wire
from armtempo_shared.sequence import ACTIVE, FAULT_THEN, NEXT_THEN, SequenceData, SequenceError

from armtempo.basics.errors import InputError
from armtempo.encoding import encoded_sequence
from armtempo.link import Client
from armtempo.link.board_messages import Event, RowBegun, Sample, SequenceState
from armtempo.model import arm_json
from armtempo.model.arm import Arm
from armtempo.model.sequence_plan import SequencePlan
from armtempo.report import run_folder
from armtempo.report.run_folder import Recording, RunFolder, RunRow
from armtempo.robot.recording import origin

ACKNOWLEDGED = 8
"""Received samples are acknowledged to the board after this many."""


class Recorder:
    """Receives a running sequence's events; the base class keeps nothing."""

    path: Path | None = None
    """The run folder, if any."""

    def take(self, event: Event) -> None:
        """Handle an event."""

    def end(self, state: SequenceState) -> None:
        """The sequence has ended, in whatever way."""


@dataclass(frozen=True, eq=False)
class SequenceContent:
    """The record of a sequence, and those of its motions."""

    name: str
    arm: Arm
    record: SequenceData
    legs: tuple[bytes, ...]
    plan: SequencePlan | None

    @property
    def words(self) -> tuple[str, ...]:
        """A description of each row."""
        if self.plan is not None:
            return tuple(row.words for row in self.plan.rows)
        names = [output.name for output in self.arm.outputs], [one.name for one in self.arm.inputs]
        return describe_rows(self.record, *names)


def of_plan(plan: SequencePlan) -> SequenceContent:
    """Content of a planned sequence."""
    encoded = encoded_sequence.of_plan(plan)
    legs = tuple(motion.data for motion in encoded.motions)
    return SequenceContent(plan.name, plan.arm, SequenceData(encoded.data), legs, plan)


def fetched(client: Client, name: str, arm: Arm) -> SequenceContent:
    """Content of a stored sequence; raises InputError if its record is damaged or of another version."""
    try:
        record = SequenceData(client.fetch(name))
    except SequenceError as error:
        raise InputError(
            f"sequence {name!r} on the board: {error}", "plan it again and 'armtempo upload --force' it"
        ) from error
    legs = tuple(client.fetch(record.motion(index)[0]) for index in range(record.motions))
    return SequenceContent(name, arm, record, legs, None)


@contextmanager
def recorder(client: Client, content: SequenceContent, parent: Path, port: str) -> Iterator[Recorder]:
    """A recorder that writes one run into a new run folder in ``parent``."""
    record = content.record
    rows = tuple(
        RunRow(row[4], row[1] + 1 if row[0] == sequence.MOVE else 0, words)
        for row, words in zip(map(record.row, range(record.rows)), content.words, strict=True)
    )
    with ExitStack() as ends:
        with run_folder.new_folder(parent, content.name) as path:
            folder = RunFolder(
                path,
                content.name,
                run_folder.scales(content.arm),
                origin(client, content.arm, port),
                legs=tuple(record.motion(index)[0] for index in range(record.motions)),
                rows=rows,
            )
            folder.write_legs(content.legs)
            if content.plan is not None:
                content.plan.save(path / run_folder.SEQUENCE)
            else:
                arm_json.save(content.arm, path / run_folder.ARM)
            recording = ends.enter_context(folder.begin_repetition(with_rows=True))
        yield _FolderRecorder(client, folder, recording)


class _FolderRecorder(Recorder):
    def __init__(self, client: Client, folder: RunFolder, recording: Recording) -> None:
        self.path = folder.path
        self._client = client
        self._rows = folder.rows
        self._recording = recording
        self._begun_s = client.session.clock()
        self._run, self._row = 0, -1  # number of the motion's run that was reported last, and its row

    def take(self, event: Event) -> None:
        if isinstance(event, RowBegun):
            self._recording.begin_row(event, self._client.session.clock() - self._begun_s)
            if event.row < len(self._rows) and self._rows[event.row].leg:
                self._run, self._row = event.run, event.row
        elif isinstance(event, Sample):
            self._recording.append(event, self._row if event.run == self._run else None)
            if self._recording.repetition.samples % ACKNOWLEDGED == 0:
                self._client.samples(event.index + 1)

    def end(self, state: SequenceState) -> None:
        code = wire.ERRORS[state.code][0] if state.code in wire.ERRORS else str(state.code or "")
        taken_s = self._client.session.clock() - self._begun_s
        self._recording.repetition.end_rows(state, code, self._client.counters(), taken_s)


_THEN = {NEXT_THEN: "next", FAULT_THEN: "fault"}


def describe_rows(record: SequenceData, outputs: Sequence[str], inputs: Sequence[str]) -> tuple[str, ...]:
    """One text per row; ``outputs``, ``inputs``: names in the order of the arm file."""
    return tuple(_describe_row(record, record.row(index), outputs, inputs) for index in range(record.rows))


def _describe_row(
    record: SequenceData, row: tuple[int, ...], outputs: Sequence[str], inputs: Sequence[str]
) -> str:
    op, number, value, amount, _ = row
    if op == sequence.MOVE:
        return f"run {record.motion(number)[0]}"
    if op == sequence.OUTPUT:
        return f"output {_name(outputs, number)} to {value} of 65535"
    if op == sequence.WAIT:
        return f"wait {amount / 1000:g} s"
    if op == sequence.WAIT_INPUT:
        limit = f", at most {amount / 1000:g} s, then {_THEN.get(value & ~ACTIVE, 'stop')}" if amount else ""
        return f"wait for input {_name(inputs, number)}{'' if value & ACTIVE else ' not'}{limit}"
    if op == sequence.REPEAT:
        return f"repeat {amount} times" if amount else "repeat for ever"
    if op == sequence.COUNT:
        return f"count {record.counter(number).decode(errors='replace')}"
    return "end of repeat"


def _name(names: Sequence[str], number: int) -> str:
    return names[number] if number < len(names) else str(number + 1)
