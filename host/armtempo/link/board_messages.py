"""The board's answers and events as dataclasses: the host's view of the message table."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Any

from armtempo_shared import wire
from armtempo_shared.limits import TICK_HZ

from armtempo.formats.plain_text import visible
from armtempo.virtual_id import is_virtual


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
    """Bytes of memory that the engine for an arm can have (``armtempo_shared.engine_memory``)."""
    engine_joints: int
    """Joints that an engine can have."""
    arm_problem: int
    """Code of what is wrong with the stored arm record; 0 where it is in force or there is none."""
    arm_value: int
    board_id: str

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
    samples_kept: int
    samples_lost: int
    frames_bad: int
    positions: Positions

    @property
    def moving(self) -> bool:
        """Whether steps may still come."""
        return self.state in ("moving", "braking")

    def joint_known(self, joint: int) -> bool:
        """Whether the position of this joint (from 0) is known."""
        return bool(self.known >> joint & 1)


@dataclass(frozen=True)
class StoredMotion:
    """One stored motion; ``crc``, ``duration_ticks`` and ``joints`` are 0 where it is damaged."""

    name: str
    size: int
    crc: int
    duration_ticks: int
    joints: int
    default: bool
    """Whether the board's button starts it."""

    @property
    def duration_s(self) -> float:
        """Motion time, seconds."""
        return self.duration_ticks / TICK_HZ


@dataclass(frozen=True)
class Sample:
    """One sample; ``ticks`` is the motion clock."""

    run: int
    index: int
    ticks: int
    flags: int
    positions: Positions


@dataclass(frozen=True)
class Done:
    """A motion ended as planned, or after a stop."""

    run: int
    ticks: int
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
    positions: Positions


@dataclass(frozen=True)
class Notice:
    """A text from the board program, such as a traceback."""

    text: str


Event = Sample | Done | Fault | Notice


def state_name(number: int) -> str:
    """Name of a state; a number the host does not know is shown as such."""
    return wire.STATES[number] if number < len(wire.STATES) else f"state {number}"


def positions(tail: bytes) -> Positions:
    """The tail of status, sample, done and fault: two int32 a joint; WireError where it does not fit."""
    if len(tail) % 8:
        raise wire.WireError("length")
    values = struct.unpack(f"<{len(tail) // 4}i", tail)
    return Positions(values[0::2], values[1::2])


def event(number: int, payload: bytes) -> Event:
    """An event from its message id and payload; WireError where it is none."""
    entry = wire.EVENT_BY_ID.get(number)
    if entry is None:
        raise wire.WireError("not an event")
    return _event(entry[0], *decode(entry, payload))


def decode(entry: tuple[Any, ...], payload: bytes) -> tuple[tuple[Any, ...], Any]:
    """Values and tail of a payload, control characters spelt out; WireError where it does not fit."""
    values, tail = wire.decode(entry, payload)
    return values, visible(tail) if isinstance(tail, str) else tail


def _event(name: str, values: tuple[Any, ...], tail: Any) -> Event:
    if name == "notice":
        return Notice(tail)
    kinds: dict[str, type[Sample | Done | Fault]] = {"sample": Sample, "done": Done, "fault": Fault}
    if name not in kinds:
        raise wire.WireError("not an event")
    fields = [*values, positions(tail)]
    return kinds[name](*fields)
