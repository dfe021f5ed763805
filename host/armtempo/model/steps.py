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
"""What the sequence does after the time-out of an input: it ends normally, ends with a fault, or continues."""
FOR_EVER = "for ever"
MOST_S = MAX_WAIT_MS / 1000
"""Longest wait."""


@checked_fields
@dataclass(frozen=True, eq=False)
class SourceMotion:
    """The file of a job (to be planned) or of a plan."""

    name: str
    source: Job | Plan


@dataclass(frozen=True)
class Placed:
    """A step, with its place in a file if it comes from one."""

    _: KW_ONLY
    where: str = ""
    """File and step, for messages."""
    step: int = 0
    """Its number in the sequence's file, from 1."""


@checked_fields
@dataclass(frozen=True, eq=False)
class Goto(Placed):
    """Move straight to a posture (a name, or angles in degrees (J,)) or to the start of a motion."""

    target: ArmPosture | SourceMotion | Job | Plan | str | tuple[float, ...]
    line: bool = field(default=False, kw_only=True)
    """Move the tool in a straight line."""
    speed_mm_s: float | None = field(default=None, kw_only=True)
    """Speed limit of the tool on a line."""


@checked_fields
@dataclass(frozen=True, eq=False)
class RunMotion(Placed):
    """Run a motion."""

    motion: SourceMotion | Job | Plan


@checked_fields
@dataclass(frozen=True)
class SetOutput(Placed):
    """Set an output of the arm to one of its states, or to a number in its unit."""

    output: str
    to: float | str


@checked_fields
@dataclass(frozen=True)
class Hold(Placed):
    """The tool holds a load of the arm from now on; "nothing": none."""

    load: str


@checked_fields
@dataclass(frozen=True)
class UseTool(Placed):
    """This tool of the arm is on it from now on; "nothing": none."""

    tool: str


@checked_fields
@dataclass(frozen=True)
class Wait(Placed):
    """Wait for a time."""

    wait_s: float

    def __post_init__(self) -> None:
        """Raise InputError for a time that the board does not support."""
        _check_wait(self.wait_s)


@checked_fields
@dataclass(frozen=True)
class WaitInput(Placed):
    """Wait until an input of the arm is active, or not; ``timeout_s`` 0: no limit."""

    input: str
    active: bool = True
    timeout_s: float = 0.0
    on_timeout: str = STOP
    """``"stop"``, ``"fault"`` or ``"next"``."""

    def __post_init__(self) -> None:
        """Raise InputError for values that the board does not support."""
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
    """Repeat steps ``times`` times; 0: for ever."""

    steps: tuple[Step, ...]
    times: int = 0

    def __post_init__(self) -> None:
        """Raise InputError for a number that the board does not support."""
        object.__setattr__(self, "steps", tuple(self.steps))
        if not 0 <= self.times <= MAX_REPEATS:
            raise InputError(
                f"a repeat of {self.times} times is not allowed", f"give 1 to {MAX_REPEATS}, or 0: for ever"
            )


@checked_fields
@dataclass(frozen=True)
class EachPlace(Placed):
    """Repeat steps for each place of a pallet of the arm."""

    steps: tuple[Step, ...]
    pallet: str
    first: int = 1
    """Number of its first place here: columns are counted first, then rows, then layers."""
    last: int = 0
    """Number of its last place here; 0: the last of the pallet."""
    reverse: bool = False
    """From the last place to the first, as one empties it."""

    def __post_init__(self) -> None:
        """Make a tuple of the steps."""
        object.__setattr__(self, "steps", tuple(self.steps))


@checked_fields
@dataclass(frozen=True)
class ToPlace(Placed):
    """Move to the point above the present place of a pallet, and from there to it in a straight line."""

    pallet: str
    leave: bool = field(default=False, kw_only=True)
    """Instead: from the place in a straight line to the point above it."""
    speed_mm_s: float | None = field(default=None, kw_only=True)
    """Speed limit of the tool on the line."""


Step = Goto | RunMotion | SetOutput | Hold | UseTool | Wait | WaitInput | Count | Repeat | EachPlace | ToPlace


def _check_wait(wait_s: float) -> None:
    if not 0.001 <= wait_s <= MOST_S:
        raise InputError(f"a wait of {wait_s:g} s is not allowed", f"give 0.001 to {MOST_S:g} s")


def position(step: int, finished: int) -> str:
    """Describe where a sequence is; ``finished``: the cycles before this one, which is counted from 1.

    ``step``: from 1; 0 before the first step, where it is on its way to that one.
    """
    return f"step {max(step, 1)} of cycle {finished + 1}"


def whole_cycles(finished: int) -> str:
    """Describe the number of finished cycles."""
    return f"{finished} whole cycle{'s' * (finished != 1)}"
