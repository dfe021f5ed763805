"""The steps of a sequence: motions, outputs and waits."""

from __future__ import annotations

from dataclasses import dataclass

from armtempo.model.job import Job
from armtempo.model.plan import Plan
from armtempo.model.posture import ArmPosture

STOP, FAULT, NEXT = "stop", "fault", "next"
ON_TIMEOUT = (STOP, FAULT, NEXT)
"""What happens where an input does not come in time: the sequence ends in order, or by a fault, or goes on."""
FOR_EVER = "for ever"


@dataclass(frozen=True, eq=False)
class SourceMotion:
    """A job that is still to be planned, or a plan, by its file."""

    name: str
    source: Job | Plan


@dataclass(frozen=True)
class Placed:
    """A step of a sequence file."""

    where: str
    """File and step, for messages."""
    step: int
    """Its number in the sequence's own file, from 1."""


@dataclass(frozen=True, eq=False)
class Goto(Placed):
    """Move straight to a posture, or to where a motion begins."""

    target: ArmPosture | SourceMotion


@dataclass(frozen=True, eq=False)
class RunMotion(Placed):
    """Run a motion from its beginning."""

    motion: SourceMotion


@dataclass(frozen=True)
class SetOutput(Placed):
    """Set an output; ``raw`` as the board takes it, ``words`` as the user wrote it."""

    number: int
    raw: int
    words: str


@dataclass(frozen=True)
class Wait(Placed):
    """Wait for a time."""

    wait_s: float


@dataclass(frozen=True)
class WaitInput(Placed):
    """Wait until an input is active, or not; ``timeout_s`` 0: for ever."""

    number: int
    active: bool
    timeout_s: float
    on_timeout: str
    words: str


@dataclass(frozen=True)
class Count(Placed):
    """Add one to a counter."""

    counter: str


@dataclass(frozen=True)
class Repeat(Placed):
    """Steps that come ``times`` times, 0: for ever."""

    times: int
    steps: tuple[Step, ...]


Step = Goto | RunMotion | SetOutput | Wait | WaitInput | Count | Repeat
