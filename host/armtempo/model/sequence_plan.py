"""A planned sequence: its motions, and the rows that the board executes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar, Literal

from armtempo_shared import sequence as record
from armtempo_shared.sequence import COUNT, END, MOVE, REPEAT, WAIT

from armtempo.basics import json_codec
from armtempo.basics.arguments import checked
from armtempo.basics.errors import InputError
from armtempo.model import arm_json
from armtempo.model.arm import Arm
from armtempo.model.plan import Plan
from armtempo.model.plan_file import AGAIN, PlanFile
from armtempo.splines.trajectory import Trajectory

PAUSE_S = 0.015
"""Approximate time from the end of a motion to the start of the next, if the board prepares motions
(host/docs/sequences.md)."""
FILE = PlanFile(
    "armtempo sequence",
    "sequence",
    "a planned sequence",
    "armtempo plan SEQUENCE.toml",
    "a sequence's plan is replaced by one of a sequence of the same name",
    (2,),
)


@dataclass(frozen=True)
class SequenceRow:
    """One row of the record (``armtempo_shared.sequence``), with a description."""

    op: int
    number: int
    value: int
    amount: int
    step: int
    words: str


@dataclass(frozen=True)
class Share:
    """The parts of a duration."""

    motion_s: float = 0.0
    wait_s: float = 0.0
    motions: int = 0
    """Number of motions; before each is a pause."""

    @property
    def total_s(self) -> float:
        """The sum."""
        return self.motion_s + self.wait_s + PAUSE_S * self.motions

    def __add__(self, other: Share) -> Share:
        return Share(self.motion_s + other.motion_s, self.wait_s + other.wait_s, self.motions + other.motions)

    def __mul__(self, times: int) -> Share:
        return Share(self.motion_s * times, self.wait_s * times, self.motions * times)


@dataclass(frozen=True)
class Cycle:
    """One pass of a repeat."""

    step: int
    times: int
    """0: for ever."""
    share: Share


@checked
@dataclass(frozen=True, eq=False, repr=False)
class SequencePlan:
    """A planned sequence for ``arm``."""

    arm: Arm
    name: str
    legs: tuple[Trajectory, ...]
    """Its different motions; NAME-1, NAME-2, … on the board."""
    rows: tuple[SequenceRow, ...]
    counters: tuple[str, ...]
    """Names of the counters, by their number in the rows."""
    versions: Mapping[str, str]
    loads: tuple[str, ...] = field(default=(), metadata=json_codec.ADDED)
    """What the tool holds in each leg; "": nothing."""
    notes: tuple[str, ...] = field(default=(), metadata=json_codec.ADDED)
    """On the motions that were planned, each with the motion's name."""
    frames: tuple[str, ...] = field(default=(), metadata=json_codec.ADDED)
    """The frames of the arm in which something of it was given."""
    tools: tuple[str, ...] = field(default=(), metadata=json_codec.ADDED)
    """The tool in each leg, "nothing": none; (): that of ``arm`` in all."""
    pallets: tuple[str, ...] = field(default=(), metadata=json_codec.ADDED)
    """The pallets of the arm that it uses."""
    is_sequence: ClassVar[Literal[True]] = True

    def __repr__(self) -> str:
        return f"<SequencePlan {self.name!r} for {self.arm.name!r}: {len(self.rows)} rows, {len(self.legs)} motions>"

    @property
    def loaded_legs(self) -> list[tuple[Arm, Trajectory]]:
        """Each leg with the arm as it is there, with its tool and load."""
        none = ("",) * len(self.legs)
        each = zip(self.tools or none, self.loads or none, self.legs, strict=False)
        return [(self.arm.with_tool(tool).holding(load), leg) for tool, load, leg in each]

    @property
    def start_deg(self) -> tuple[float, ...] | None:
        """Start posture, degrees (J,); None if nothing moves."""
        for row in self.rows:
            if row.op == MOVE:
                return tuple(float(angle) for angle in self.legs[row.number](0.0))
        return None

    @property
    def cycles(self) -> tuple[Cycle, ...]:
        """One pass of each outermost repeat."""
        return self._times()[1]

    @property
    def total(self) -> Share | None:
        """The whole sequence without waits for inputs; None if it has no end."""
        return self._times()[0]

    def _times(self) -> tuple[Share | None, tuple[Cycle, ...]]:
        open_: list[tuple[SequenceRow, Share]] = []
        share, endless = Share(), False
        cycles = []
        for row in self.rows:
            if row.op == MOVE:
                share += Share(motion_s=self.legs[row.number].duration_s, motions=1)
            elif row.op == WAIT:
                share += Share(wait_s=row.amount / 1000)
            elif row.op == REPEAT:
                open_.append((row, share))
                share = Share()
            elif row.op == END:
                begun, before = open_.pop()
                if row.value:
                    times = begun.amount + begun.value if begun.amount else 0
                    cycles.append(Cycle(begun.step, times, share))
                endless = endless or not begun.amount
                share = before + share * begun.amount
        return (None if endless else share), tuple(cycles)

    def save(self, path: Path | str, force: bool = False) -> None:
        """Write the sequence's plan, atomically.

        Replaces only a plan of a sequence of this name; ``force``: any file. Raises InputError if it may not
        be replaced, or cannot be written.
        """
        FILE.save(path, self, force, lambda content: bool(content["name"] == self.name))

    @classmethod
    def load(cls, path: Path | str, altered: bool = False) -> SequencePlan:
        """The plan of a file written by ``save``; raises InputError if it is invalid, damaged or altered.

        ``altered``: accept a file that was altered after it had been written.
        """
        plan: SequencePlan = json_codec.decode(cls, FILE.read(path, altered), f"{path}: sequence")
        arm_json.check(plan.arm, f"{path}: arm", AGAIN)
        there = {MOVE: len(plan.legs), COUNT: len(plan.counters)}
        if any(not 0 <= row.number < there.get(row.op, row.number + 1) for row in plan.rows):
            raise InputError(f"{path}: a row names a motion or counter that does not exist", AGAIN)
        return plan


AnyPlan = Plan | SequencePlan
"""What is planned, stored and run: both have name, arm, start, legs with their loads, frames, notes and a file."""


def load_plan(path: Path | str, altered: bool = False) -> AnyPlan:
    """The plan of a file, of a motion or a sequence; raises as ``Plan.load``."""
    return (SequencePlan if FILE.is_at(Path(path)) else Plan).load(path, altered)


def rows_of(plan: SequencePlan) -> list[tuple[int, ...]]:
    """The rows as ``armtempo_shared.sequence.pack`` takes them."""
    return [(row.op, row.number, row.value, row.amount, row.step) for row in plan.rows]


def check_size(rows: int, legs: int, counters: int, where: str) -> None:
    """Raise InputError if the sequence is too large for the board."""
    if counters > record.MAX_COUNTERS:
        raise InputError(
            f"{where}: {counters} counters; the board keeps {record.MAX_COUNTERS} for a sequence",
            "use fewer counters",
        )
    if rows > record.MAX_ROWS or legs > record.MAX_MOTIONS:
        raise InputError(
            f"{where}: {rows} rows and {legs} motions; the board takes {record.MAX_ROWS} and {record.MAX_MOTIONS}",
            "use repeat, or split it into two sequences; of a pallet, plan some of its layers or rows",
        )
