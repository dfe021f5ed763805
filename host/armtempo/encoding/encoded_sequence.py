"""A sequence for the board: its record, and those of its motions."""

from __future__ import annotations

from dataclasses import dataclass

from armtempo_shared import sequence, sequence_check
from armtempo_shared.wire import record_crc

from armtempo.encoding import encode, encoded_motion
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
    sequence_check.check(sequence.SequenceData(data))
    return EncodedSequence(plan, motions, data)
