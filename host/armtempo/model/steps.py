"""The steps of a sequence: motions, outputs and waits, by the names of the arm."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, field

from armtempo_shared.sequence import MAX_REPEATS, MAX_WAIT_MS

from armtempo.basics.arguments import checked_fields
from armtempo.basics.errors import InputError
from armtempo.model.job import Job, is_name
from armtempo.model.plan import Plan
from armtempo.model.posture import ArmPosture

STOP, FAULT, NEXT = "stop", "fault", "next"
ON_TIMEOUT = (STOP, FAULT, NEXT)
"""What happens where an input does not come in time: the sequence ends in order, or by a fault, or continues."""
FOR_EVER = "for ever"
MOST_S = MAX_WAIT_MS / 1000
"""Longest wait."""


@checked_fields
@dataclass(frozen=True, eq=False)
class SourceMotion:
    """A job that is still to be planned, or a plan, by its file."""

    name: str
    source: Job | Plan


@dataclass(frozen=True)
class Placed:
    """A step; where it comes from a file, that file."""

    _: KW_ONLY
    where: str = ""
    """File and step, for messages."""
    step: int = 0
    """Its number in the sequence's own file, from 1."""


@checked_fields
@dataclass(frozen=True, eq=False)
class Goto(Placed):
    """Move straight to a posture: of the arm by its name, or by angles in degrees (J,); or to where a motion begins."""

    target: ArmPosture | SourceMotion | Job | Plan | str | tuple[float, ...]
    line: bool = field(default=False, kw_only=True)
    """The tool goes there in a straight line."""
    speed_mm_s: float | None = field(default=None, kw_only=True)
    """Of the tool on a line at most."""


@checked_fields
@dataclass(frozen=True, eq=False)
class RunMotion(Placed):
    """Run a motion from its beginning."""

    motion: SourceMotion | Job | Plan


@checked_fields
@dataclass(frozen=True)
class SetOutput(Placed):
    """Set an output of the arm to a state of it, or to a number in its unit."""

    output: str
    to: float | str


@checked_fields
@dataclass(frozen=True)
class Hold(Placed):
    """The tool holds a load of the arm from now on; "nothing": none."""

    load: str


@checked_fields
@dataclass(frozen=True)
class Wait(Placed):
    """Wait for a time."""

    wait_s: float

    def __post_init__(self) -> None:
        """InputError for a time that the board cannot wait."""
        _check_wait(self.wait_s)


@checked_fields
@dataclass(frozen=True)
class WaitInput(Placed):
    """Wait until an input of the arm is active, or not; ``timeout_s`` 0: for ever."""

    input: str
    active: bool = True
    timeout_s: float = 0.0
    on_timeout: str = STOP
    """``"stop"``, ``"fault"`` or ``"next"``."""

    def __post_init__(self) -> None:
        """InputError for what the board cannot do."""
        if self.timeout_s:
            _check_wait(self.timeout_s)
        if self.on_timeout not in ON_TIMEOUT:
            raise InputError(
                f"on_timeout {self.on_timeout!r} is not allowed", f"give {' or '.join(map(repr, ON_TIMEOUT))}"
            )


@checked_fields
@dataclass(frozen=True)
class Count(Placed):
    """Add one to a counter."""

    counter: str

    def __post_init__(self) -> None:
        """InputError for a name that the board cannot keep."""
        if not is_name(self.counter):
            raise InputError(
                f"counter {self.counter!r}: not a valid name on the board", "use a-z A-Z 0-9 - _"
            )


@checked_fields
@dataclass(frozen=True)
class Repeat(Placed):
    """Steps that come ``times`` times, 0: for ever."""

    steps: tuple[Step, ...]
    times: int = 0

    def __post_init__(self) -> None:
        """InputError for what the board cannot count."""
        object.__setattr__(self, "steps", tuple(self.steps))
        if not 0 <= self.times <= MAX_REPEATS:
            raise InputError(
                f"a repeat of {self.times} times is not allowed", f"give 1 to {MAX_REPEATS}, or 0: for ever"
            )


Step = Goto | RunMotion | SetOutput | Hold | Wait | WaitInput | Count | Repeat


def _check_wait(wait_s: float) -> None:
    if not 0.001 <= wait_s <= MOST_S:
        raise InputError(f"a wait of {wait_s:g} s is not allowed", f"give 0.001 to {MOST_S:g} s")
