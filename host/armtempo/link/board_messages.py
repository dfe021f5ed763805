"""The board's answers and events as dataclasses: the host's view of the message table."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Any

from armtempo_shared import wire
from armtempo_shared.limits import TICK_HZ
from armtempo_shared.messages import FEATURES, RATES_MEASURED
from armtempo_shared.sequence import ENDINGS

from armtempo.basics.text import visible
from armtempo.ports.names import is_virtual


@dataclass(frozen=True)
class Hello:
    """Who answers on the port."""

    protocol: int
    joints: int
    encoders: int
    state: str
    tick_hz: int
    max_rate: int
    max_rate_sum: int
    free_flash: int
    free_heap: int
    arm_crc: int
    program_crc: int
    boot: int
    engine_room: int
    """Bytes of heap that the engine for an arm can have, with its objects (``armtempo_shared.engine_memory``)."""
    features: int
    """Bits of what the program can do beyond one motion at a time, by ``messages.FEATURES``."""
    arm_problem: int
    """Code of what is wrong with the stored arm record; 0 if it is in force or there is none."""
    arm_value: int
    board_id: str

    def can(self, feature: str) -> bool:
        """Whether the program can do one of ``messages.FEATURES``; in the firmware it can do all."""
        return bool(self.features >> FEATURES.index(feature) & 1)

    @property
    def rates_measured(self) -> bool:
        """Whether ``max_rate`` and ``max_rate_sum`` were measured by its self-test; else they are estimated."""
        return bool(self.features & RATES_MEASURED)

    @property
    def virtual(self) -> bool:
        """Whether it is a virtual board."""
        return is_virtual(self.board_id)


@dataclass(frozen=True)
class Positions:
    """Steps commanded so far and encoder counts, one entry a joint."""

    commanded_steps: tuple[int, ...]
    counts: tuple[int, ...]


@dataclass(frozen=True)
class Status:
    """The board's answer to ``status``."""

    state: str
    fault: int
    fault_joint: int
    known: int
    run: int
    ticks: int
    path_ticks: int
    """The motion's own time, less than the clock's where the speed was below 100 %."""
    rate: int
    """Of the motion's own time, in thousandths: the one that is wanted; 0 in a pause."""
    samples_kept: int
    samples_lost: int
    frames_bad: int
    rest_ms: int
    """Until the arm rests after a stop, one that came before or one now; 0: at once."""
    positions: Positions

    @property
    def moving(self) -> bool:
        """Whether steps may still come."""
        return self.state in ("moving", "braking")

    def joint_known(self, joint: int) -> bool:
        """Whether the position of this joint (from 0) is known."""
        return bool(self.known >> joint & 1)

    def as_fault(self) -> Fault:
        """The event that reported the pending fault, where it did not arrive."""
        return Fault(self.run, self.fault, self.fault_joint, self.ticks, self.path_ticks, self.positions)


@dataclass(frozen=True)
class Levels:
    """The board's answer to ``inputs``."""

    inputs: int
    """One bit per input of the arm record: it is active."""
    outputs: tuple[int, ...]
    """The value of each output, 0 to 65535."""

    def active(self, number: int) -> bool:
        """Whether an input (from 0) is active."""
        return bool(self.inputs >> number & 1)


@dataclass(frozen=True)
class StoredMotion:
    """One stored motion; ``crc``, ``duration_ticks`` and ``joints`` are 0 if it is damaged."""

    name: str
    size: int
    crc: int
    duration_ticks: int
    joints: int
    default: bool
    """Whether the board's button starts it."""
    sequence: bool = False
    """Whether it is a sequence, which has neither ``duration_ticks`` nor ``joints`` of its own."""

    @property
    def duration_s(self) -> float:
        """Motion time, seconds."""
        return self.duration_ticks / TICK_HZ


@dataclass(frozen=True)
class SequenceState:
    """How far a sequence is, or where the last one ended."""

    ending: str
    """One of ``armtempo_shared.sequence.ENDINGS``."""
    code: int
    """Of the fault or refusal that ended it."""
    step: int
    """Of the sequence file, from 1."""
    row: int
    cycle: int
    """Finished passes of its outermost repeats."""
    name: str


@dataclass(frozen=True)
class Sample:
    """One sample; ``ticks`` is the motion clock, ``path_ticks`` the motion's own time."""

    run: int
    index: int
    ticks: int
    path_ticks: int
    flags: int
    positions: Positions


@dataclass(frozen=True)
class Done:
    """A motion ended as planned, or after a stop."""

    run: int
    ticks: int
    path_ticks: int
    samples: int
    lost: int
    positions: Positions


@dataclass(frozen=True)
class Fault:
    """A motion ended by a fault."""

    run: int
    code: int
    joint: int
    ticks: int
    path_ticks: int
    positions: Positions


@dataclass(frozen=True)
class RowBegun:
    """A row of the sequence that runs has begun."""

    passed: int
    """How many had, since its start, with this one."""
    run: int
    """Of the last motion that it has started; of this row, where it moves."""
    row: int
    step: int
    cycle: int
    value: int
    """Of the counter, where the row counts."""


@dataclass(frozen=True)
class Notice:
    """A text from the board program, such as a traceback."""

    text: str


Event = Sample | Done | Fault | RowBegun | Notice


def state_name(number: int) -> str:
    """Name of a state; a number the host does not know is shown as such."""
    return wire.STATES[number] if number < len(wire.STATES) else f"state {number}"


def ending_name(number: int) -> str:
    """The state of a sequence; a number the host does not know is shown as such."""
    return ENDINGS[number] if number < len(ENDINGS) else f"ending {number}"


def positions(tail: bytes) -> Positions:
    """The tail of status, sample, done and fault: two int32 a joint; WireError if it does not fit."""
    if len(tail) % 8:
        raise wire.WireError("length")
    values = struct.unpack(f"<{len(tail) // 4}i", tail)
    return Positions(values[0::2], values[1::2])


def levels(inputs: int, tail: bytes) -> Levels:
    """The answer to ``inputs``; WireError if the tail does not fit."""
    if len(tail) % 2:
        raise wire.WireError("length")
    return Levels(inputs, struct.unpack(f"<{len(tail) // 2}H", tail))


def event(number: int, payload: bytes) -> Event:
    """An event from its message id and payload; WireError if it is none."""
    entry = wire.EVENT_BY_ID.get(number)
    if entry is None:
        raise wire.WireError("not an event")
    return _event(entry[0], *decode(entry, payload))


def decode(entry: tuple[Any, ...], payload: bytes) -> tuple[tuple[Any, ...], Any]:
    """Values and tail of a payload, control characters spelt out; WireError if it does not fit."""
    values, tail = wire.decode(entry, payload)
    return values, visible(tail) if isinstance(tail, str) else tail


def _event(name: str, values: tuple[Any, ...], tail: Any) -> Event:
    if name == "notice":
        return Notice(tail)
    if name == "row":
        return RowBegun(*values)
    kinds: dict[str, type[Sample | Done | Fault]] = {"sample": Sample, "done": Done, "fault": Fault}
    if name not in kinds:
        raise wire.WireError("not an event")
    fields = [*values, positions(tail)]
    return kinds[name](*fields)
