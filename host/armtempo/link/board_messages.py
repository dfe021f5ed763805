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
    """The board's answer to ``hello``."""

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
    engine_bytes: int
    """Bytes of heap that the engine for an arm can have, with its objects (``armtempo_shared.engine_memory``)."""
    features: int
    """One bit per optional feature of the program, see ``messages.FEATURES``."""
    arm_problem: int
    """Error code of the stored arm record; 0 if it is used or there is none."""
    arm_value: int
    once_bytes: int
    """Bytes of the largest record that is run once from the board's memory, without being stored."""
    board_id: str

    def can(self, feature: str) -> bool:
        """Whether the program has one of ``messages.FEATURES``; in the firmware it has all."""
        return bool(self.features >> FEATURES.index(feature) & 1)

    @property
    def rates_measured(self) -> bool:
        """Whether ``max_rate`` and ``max_rate_sum`` were measured by its self-test; otherwise they are estimates."""
        return bool(self.features & RATES_MEASURED)

    @property
    def virtual(self) -> bool:
        """Whether it is a virtual board."""
        return is_virtual(self.board_id)


@dataclass(frozen=True)
class Positions:
    """Commanded steps and encoder counts, one entry per joint."""

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
    """The motion's own time; it lags behind the clock while the speed is below 100 %."""
    rate: int
    """Requested rate of the motion's own time, in thousandths; 0 in a pause."""
    samples_kept: int
    samples_lost: int
    frames_bad: int
    rest_ms: int
    """Time until the arm is at rest, after a stop given earlier or now; 0: at once."""
    positions: Positions

    @property
    def moving(self) -> bool:
        """Whether the board may still make steps."""
        return self.state in ("moving", "braking")

    def joint_known(self, joint: int) -> bool:
        """Whether the position of this joint (from 0) is known."""
        return bool(self.known >> joint & 1)

    def as_fault(self) -> Fault:
        """The pending fault as an event, in case the event was lost."""
        return Fault(self.run, self.fault, self.fault_joint, self.ticks, self.path_ticks, self.positions)


@dataclass(frozen=True)
class Levels:
    """The board's answer to ``inputs``."""

    inputs: int
    """One bit per input of the arm record, set if it is active."""
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
    """Whether it is a sequence, without ``duration_ticks`` and ``joints``."""
    program: bool = False
    """Whether it is a user's program, without them too."""

    @property
    def duration_s(self) -> float:
        """Motion time, seconds."""
        return self.duration_ticks / TICK_HZ


@dataclass(frozen=True)
class SequenceState:
    """State of the running sequence, or of the last one."""

    ending: str
    """One of ``armtempo_shared.sequence.ENDINGS``."""
    code: int
    """Code of the fault or refusal that ended it."""
    step: int
    """Step of the sequence file, or line of the program, from 1."""
    row: int
    cycle: int
    """Finished passes of its outermost repeats."""
    name: str
    """Of a program with the ending ``.py``."""


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
    """A motion has ended as planned, or after a stop."""

    run: int
    ticks: int
    path_ticks: int
    samples: int
    lost: int
    positions: Positions


@dataclass(frozen=True)
class Fault:
    """A fault has ended a motion."""

    run: int
    code: int
    joint: int
    ticks: int
    path_ticks: int
    positions: Positions


@dataclass(frozen=True)
class RowBegun:
    """A row of the running sequence has begun."""

    passed: int
    """Number of rows begun since its start, including this one."""
    run: int
    """Run number of the last motion that it started (of this row, if it moves)."""
    row: int
    step: int
    cycle: int
    value: int
    """Value of the counter, if the row counts."""


@dataclass(frozen=True)
class Notice:
    """A text from the board program, such as a traceback."""

    text: str


Event = Sample | Done | Fault | RowBegun | Notice


def state_name(number: int) -> str:
    """Name of a state; for an unknown number, text with the number."""
    return wire.STATES[number] if number < len(wire.STATES) else f"state {number}"


def ending_name(number: int) -> str:
    """Name of a sequence's state; for an unknown number, text with the number."""
    return ENDINGS[number] if number < len(ENDINGS) else f"ending {number}"


def positions(tail: bytes) -> Positions:
    """The tail of status, sample, done and fault: two int32 per joint; raises WireError if its length is wrong."""
    if len(tail) % 8:
        raise wire.WireError("length")
    values = struct.unpack(f"<{len(tail) // 4}i", tail)
    return Positions(values[0::2], values[1::2])


def levels(inputs: int, tail: bytes) -> Levels:
    """The answer to ``inputs``; raises WireError if the length of the tail is wrong."""
    if len(tail) % 2:
        raise wire.WireError("length")
    return Levels(inputs, struct.unpack(f"<{len(tail) // 2}H", tail))


def event(number: int, payload: bytes) -> Event:
    """An event from its message id and payload; raises WireError if it is none."""
    entry = wire.EVENT_BY_ID.get(number)
    if entry is None:
        raise wire.WireError("not an event")
    return _event(entry[0], *decode(entry, payload))


def decode(entry: tuple[Any, ...], payload: bytes) -> tuple[tuple[Any, ...], Any]:
    """Values and tail of a payload, control characters escaped; raises WireError if it does not fit."""
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
