"""A sequence for the board: its record, and those of its motions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from armtempo_shared import sequence, sequence_check
from armtempo_shared.sequence import ACTIVE, FAULT_THEN, NEXT_THEN, SequenceData
from armtempo_shared.wire import record_crc

from armtempo.encoding import encode, encoded_motion, made_with
from armtempo.encoding.encoded_motion import EncodedMotion, MotionKey
from armtempo.model.arm import Arm
from armtempo.model.sequence_plan import SequencePlan, rows_of


@dataclass(frozen=True, eq=False)
class EncodedSequence:
    """A sequence that the board stores and runs."""

    plan: SequencePlan
    motions: tuple[EncodedMotion, ...]
    data: bytes
    """The sequence record (layout: ``armtempo_shared.sequence``)."""

    @property
    def arm(self) -> Arm:
        """The arm that it was planned for."""
        return self.plan.arm

    @property
    def key(self) -> MotionKey:
        """Its identification on the board."""
        return MotionKey(self.plan.name, record_crc(self.data))


def of_plan(plan: SequencePlan) -> EncodedSequence:
    """Encode a sequence; raises InputError or PlanError if the board cannot run it."""
    motions = tuple(encoded_motion.of_trajectory(leg, plan.arm) for leg in plan.legs)
    keys = [(motion.name, motion.key.crc) for motion in motions]
    data = sequence.pack(record_crc(encode.arm_record(plan.arm)), rows_of(plan), keys, plan.counters)
    sequence_check.check(SequenceData(data))
    return EncodedSequence(plan, motions, made_with.added(data, made_with.of_plan(plan)))


_THEN = {NEXT_THEN: "next", FAULT_THEN: "fault"}


def describe(record: SequenceData, arm: Arm) -> tuple[str, ...]:
    """What each row of a stored sequence does."""
    outputs, inputs = [output.name for output in arm.outputs], [one.name for one in arm.inputs]
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
