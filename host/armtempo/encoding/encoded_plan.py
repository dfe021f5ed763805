"""What the board stores and runs: the record of a motion, or of a sequence with those of its motions."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from armtempo_shared import program, sequence, sequence_check
from armtempo_shared.limits import MAX_NAME
from armtempo_shared.sequence import ACTIVE, FAULT_THEN, KIND_BYTES, NEXT_THEN, SequenceData, SequenceError
from armtempo_shared.wire import record_crc

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.encoding import encode, made_with
from armtempo.model.arm import Arm
from armtempo.model.leg import SequenceRow, only_row
from armtempo.model.plan import Plan
from armtempo.planning import brake_time, point_to_point
from armtempo.splines.trajectory import Trajectory


@dataclass(frozen=True)
class MotionKey:
    """The board's identification of what it stores: its name and the checksum of its record."""

    name: str
    crc: int


@dataclass(frozen=True, eq=False)
class EncodedLeg:
    """A motion on the board."""

    name: str
    trajectory: Trajectory
    data: bytes
    """The motion record (layout: ``armtempo_shared.motion``)."""


@dataclass(frozen=True, eq=False)
class Encoded:
    """What the board stores and runs, with the host's data about it."""

    name: str
    """Name on the board."""
    arm: Arm
    legs: tuple[EncodedLeg, ...]
    rows: tuple[SequenceRow, ...]
    sequence: bytes = b""
    """The sequence record (layout: ``armtempo_shared.sequence``); none: the board runs the record of the only leg."""
    plan: Plan | None = None
    """The plan, if known."""

    @classmethod
    def of_motion(
        cls, name: str, arm: Arm, trajectory: Trajectory, data: bytes, plan: Plan | None = None
    ) -> Encoded:
        """A motion alone, with its record."""
        return cls(name, arm, (EncodedLeg(name, trajectory, data),), (only_row(name),), plan=plan)

    @property
    def is_sequence(self) -> bool:
        """Whether the board runs it as a sequence, whose rows and end it reports."""
        return bool(self.sequence)

    @property
    def data(self) -> bytes:
        """The record that the board runs."""
        return self.sequence or self.legs[0].data

    @property
    def key(self) -> MotionKey:
        """Its identification on the board."""
        return MotionKey(self.name, record_crc(self.data))

    @property
    def records(self) -> tuple[tuple[str, bytes], ...]:
        """What the board stores, the one that it runs last: names and records."""
        legs = tuple((leg.name, leg.data) for leg in self.legs)
        return (*legs, (self.name, self.sequence)) if self.sequence else legs

    @property
    def trajectory(self) -> Trajectory:
        """That of a motion, whose leg is the only one."""
        (leg,) = self.legs
        return leg.trajectory

    @property
    def start_deg(self) -> Array | None:
        """Start posture, degrees (J,); None if nothing moves."""
        first = next((row.number for row in self.rows if row.op == sequence.MOVE), None)
        return None if first is None else self.legs[first].trajectory(0.0)


def of_trajectory(trajectory: Trajectory, arm: Arm) -> Encoded:
    """Encode a trajectory of ``arm`` with its times for braking and changes of speed.

    Raises InputError or PlanError if the board cannot replay it.
    """
    brakes = brake_time.of_motion(trajectory, [joint.limits for joint in arm.driven])
    return Encoded.of_motion(trajectory.name, arm, trajectory, encode.motion_record(trajectory, arm, brakes))


def way_back(motion: Encoded) -> bytes:
    """The record with which the board makes a stored motion backwards."""
    back = point_to_point.backwards(motion.trajectory, motion.name)
    brakes = brake_time.of_motion(back, [joint.limits for joint in motion.arm.driven])
    return encode.way_back(motion.data, motion.name, brakes)


def of_plan(plan: Plan, name: str | None = None) -> Encoded:
    """Encode a plan; ``name``: of a motion on the board, default from the job's name.

    Raises InputError for an invalid name, or one for a sequence; InputError or PlanError if the board cannot run it.
    """
    if plan.is_sequence:
        if name is not None:
            raise InputError(
                f"name {name!r}: the name of a sequence is in its file", "change it there and plan it again"
            )
        return _of_sequence(plan)
    if name is not None and not re.fullmatch(f"[A-Za-z0-9_-]{{1,{MAX_NAME}}}", name):
        raise InputError(
            f"{name!r} is not a valid name on the board",
            f"take 1 to {MAX_NAME} characters of a-z A-Z 0-9 - _",
        )
    board_name = name or re.sub(r"[^A-Za-z0-9_-]", "-", plan.name)[:MAX_NAME]
    data = made_with.added(of_trajectory(plan.trajectory, plan.arm).data, made_with.of_plan(plan))
    return Encoded.of_motion(board_name, plan.arm, plan.trajectory, data, plan)


def of_any(what: Plan | Encoded | Path | str, name: str | None = None) -> Encoded:
    """Encode a plan or that of a file, if it is not yet; errors as in ``of_plan`` and ``Plan.load``."""
    if isinstance(what, Encoded):
        return what
    return of_plan(what if isinstance(what, Plan) else Plan.load(what), name)


def _of_sequence(plan: Plan) -> Encoded:
    motions = [of_trajectory(leg.trajectory, plan.arm) for leg in plan.legs]
    keys = [(motion.name, motion.key.crc) for motion in motions]
    rows = [row.numbers for row in plan.rows]
    data = sequence.pack(record_crc(encode.arm_record(plan.arm)), rows, keys, plan.counters)
    sequence_check.check(SequenceData(data))
    legs = tuple(motion.legs[0] for motion in motions)
    return Encoded(plan.name, plan.arm, legs, plan.rows, made_with.added(data, made_with.of_plan(plan)), plan)


def of_record(name: str, data: bytes, arm: Arm) -> Encoded:
    """The motion of a record from the board; raises InputError if it is damaged or does not fit the arm."""
    trajectory = encode.decoded(data, arm.transmission, name, f"arm {arm.name!r}")
    return Encoded.of_motion(name, arm, trajectory, data)


def of_board(name: str, arm: Arm, fetch: Callable[[str], bytes]) -> Encoded:
    """A motion or sequence of the board, whose records ``fetch`` reads.

    Raises InputError for a program, or if a record is damaged or does not fit the arm.
    """
    data = fetch(name)
    kind = data[:KIND_BYTES]
    if kind == program.MAGIC[:KIND_BYTES]:
        raise InputError(f"{name!r} is a program, not a motion", f"run it with 'armtempo run {name}'")
    if kind != sequence.MAGIC[:KIND_BYTES]:
        return of_record(name, data, arm)
    try:
        record = SequenceData(data)
    except SequenceError as error:
        raise InputError(
            f"sequence {name!r} on the board: {error}", "plan it again and 'armtempo upload --force' it"
        ) from error
    names = [record.motion(index)[0] for index in range(record.motions)]
    legs = tuple(of_record(leg, fetch(leg), arm).legs[0] for leg in names)
    return Encoded(name, arm, legs, described(record, arm), data)


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
