"""A sequence for the board: its record, and those of its motions; and what encodes either kind of plan."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal

from armtempo_shared import sequence, sequence_check
from armtempo_shared.sequence import ACTIVE, FAULT_THEN, NEXT_THEN, SequenceData, SequenceError
from armtempo_shared.wire import record_crc

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.encoding import encode, encoded_motion, made_with
from armtempo.encoding.encoded_motion import EncodedMotion, MotionKey
from armtempo.model.arm import Arm
from armtempo.model.plan import Plan
from armtempo.model.sequence_plan import AnyPlan, SequencePlan, SequenceRow, rows_of


@dataclass(frozen=True, eq=False)
class EncodedSequence:
    """A sequence that the board stores and runs, with the host's data about it."""

    name: str
    """Name on the board."""
    arm: Arm
    motions: tuple[EncodedMotion, ...]
    rows: tuple[SequenceRow, ...]
    data: bytes
    """The sequence record (layout: ``armtempo_shared.sequence``)."""
    plan: SequencePlan | None = None
    """The plan, if known."""
    is_sequence: ClassVar[Literal[True]] = True

    @property
    def key(self) -> MotionKey:
        """Its identification on the board."""
        return MotionKey(self.name, record_crc(self.data))

    @property
    def records(self) -> tuple[tuple[str, bytes], ...]:
        """What the board stores, the motions first: names and records."""
        return (*((motion.name, motion.data) for motion in self.motions), (self.name, self.data))

    @property
    def start_deg(self) -> Array | None:
        """Start posture, degrees (J,); None if nothing moves."""
        first = next((row.number for row in self.rows if row.op == sequence.MOVE), None)
        return None if first is None else self.motions[first].start_deg


Encoded = EncodedMotion | EncodedSequence
"""What a host stores, runs and records."""


def encoded(plan: AnyPlan, name: str | None = None) -> Encoded:
    """Encode the plan of a motion or sequence; ``name``: of the motion on the board, default from the job's name.

    Raises InputError for an invalid name, or one for a sequence, and as ``of_plan``.
    """
    if isinstance(plan, Plan):
        return encoded_motion.of_plan(plan, name)
    if name is not None:
        raise InputError(
            f"name {name!r}: the name of a sequence is in its file", "change it there and plan it again"
        )
    return of_plan(plan)


def of_plan(plan: SequencePlan) -> EncodedSequence:
    """Encode a sequence; raises InputError or PlanError if the board cannot run it."""
    motions = tuple(encoded_motion.of_trajectory(leg, plan.arm) for leg in plan.legs)
    keys = [(motion.name, motion.key.crc) for motion in motions]
    data = sequence.pack(record_crc(encode.arm_record(plan.arm)), rows_of(plan), keys, plan.counters)
    sequence_check.check(SequenceData(data))
    return EncodedSequence(
        plan.name, plan.arm, motions, plan.rows, made_with.added(data, made_with.of_plan(plan)), plan
    )


def of_board(name: str, arm: Arm, fetch: Callable[[str], bytes]) -> EncodedSequence:
    """A sequence of the board, whose records ``fetch`` reads; raises InputError if one is damaged or does not fit."""
    data = fetch(name)
    try:
        record = SequenceData(data)
    except SequenceError as error:
        raise InputError(
            f"sequence {name!r} on the board: {error}", "plan it again and 'armtempo upload --force' it"
        ) from error
    names = [record.motion(index)[0] for index in range(record.motions)]
    motions = tuple(encoded_motion.of_record(leg, fetch(leg), arm) for leg in names)
    return EncodedSequence(name, arm, motions, described(record, arm), data)


_THEN = {NEXT_THEN: "next", FAULT_THEN: "fault"}


def described(record: SequenceData, arm: Arm) -> tuple[SequenceRow, ...]:
    """The rows of a stored sequence, each with what it does."""
    outputs, inputs = [output.name for output in arm.outputs], [one.name for one in arm.inputs]
    rows = []
    for index in range(record.rows):
        op, number, value, amount, step = row = record.row(index)
        words = _describe_row(record, row, outputs, inputs)
        rows.append(SequenceRow(op, number, value, amount, step, words))
    return tuple(rows)


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
