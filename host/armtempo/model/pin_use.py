"""The pin and timer of each output, input and home switch of an arm, and conflicts between them and of channels."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from armtempo.model import engine_pins
from armtempo.model.boards import BOARDS, DEFAULT, TIMER_OUTPUTS, BoardPins, TimerOutput
from armtempo.model.engine_pins import ChannelUser
from armtempo.model.outputs import SWITCH, Input, Output
from armtempo.model.parts import Joint

_MORE = "'armtempo help hardware' lists what is free"
_MOST_COUNTS = 65_535


class PinUser(ChannelUser, Protocol):
    """What is needed of an arm here."""

    @property
    def board(self) -> str:
        """Name in ``boards.BOARDS``."""

    @property
    def outputs(self) -> tuple[Output, ...]:
        """Each with its pin."""

    @property
    def inputs(self) -> tuple[Input, ...]:
        """Each with its pin."""


@dataclass(frozen=True)
class PinProblem:
    """A pin or timer that is not available."""

    where: str
    """Key of the arm file: ``"output.gripper"``."""
    what: str
    next_step: str


@dataclass(frozen=True)
class Period:
    """A timer's settings for a frequency: ``counts`` per period, each of ``prescaler`` clocks."""

    prescaler: int
    counts: int

    @classmethod
    def of(cls, output: Output, place: TimerOutput) -> Period:
        """The settings nearest to the output's frequency."""
        clocks = place.clock_hz / output.frequency_hz
        prescaler = max(1, -int(-clocks // _MOST_COUNTS))
        return cls(prescaler, min(round(clocks / prescaler), _MOST_COUNTS))

    def counts_in(self, time_us: float, place: TimerOutput) -> int:
        """A pulse width in counts."""
        return round(time_us * place.clock_hz / 1e6 / self.prescaler)


def problems(arm: PinUser) -> list[PinProblem]:
    """Conflicts of outputs, inputs and home switches with each other, the engine and the board."""
    if not (arm.outputs or arm.inputs or _home_switches(arm)) and arm.board == DEFAULT:
        return []
    board = BOARDS[arm.board]
    engine = engine_pins.taken_pins(arm)
    missing = [f"{pin} ({use})" for pin, use in engine.items() if pin not in board.pins]
    if missing:
        what = f"{board.name} does not have the pins that the engine takes: {', '.join(missing)}"
        return [PinProblem("board", what, "take a board whose chip has 100 pins or more")]
    found = _pin_problems(arm, board, engine)
    named = [problem.where for problem in found]
    return [*found, *(problem for problem in _placed(arm)[1] if problem.where not in named)]


def timer_outputs(arm: PinUser) -> dict[str, TimerOutput]:
    """The timer channel of each output with pulses, by the output's name; for an arm without problems."""
    return _placed(arm)[0]


def _pin_problems(arm: PinUser, board: BoardPins, engine: dict[str, str]) -> list[PinProblem]:
    found = []
    used = {pin: f"is taken by the engine for {use}" for pin, use in engine.items()}
    for pin, use in board.taken.items():
        used.setdefault(pin, f"is taken on the {board.name} by {use}")
    for where, pin in [
        *((f"output.{output.name}", output.pin) for output in arm.outputs),
        *((f"input.{entry.name}", entry.pin) for entry in arm.inputs),
        *_home_switches(arm),
    ]:
        if pin not in board.pins:
            found.append(
                PinProblem(where, f"the {board.name} has no pin {pin}", f"take another pin; {_MORE}")
            )
        elif pin in used:
            found.append(PinProblem(where, f"{pin} {used[pin]}", f"take another pin; {_MORE}"))
        used.setdefault(pin, f"is the pin of {where}")
    return found


def _home_switches(arm: PinUser) -> list[tuple[str, str]]:
    """(where, pin) of each switch that has a pin instead of a limit switch input."""
    return [
        (f"switches of {joint.name}", switch)
        for joint in arm.joints
        for switch in (joint.switches.low, joint.switches.high)
        if isinstance(switch, str) and joint.motor is not None
    ]


def _placed(arm: PinUser) -> tuple[dict[str, TimerOutput], list[PinProblem]]:
    found: dict[str, TimerOutput] = {}
    failed = []
    taken = engine_pins.taken_timers(arm)
    periods: dict[int, tuple[Period, str]] = {}
    for output in arm.outputs:
        if output.kind == SWITCH:
            continue
        place, why = _place(output, taken, periods, list(found.values()))
        if place is None:
            next_step = f"take a pin with a timer that is free, or one frequency for both; {_MORE}"
            failed.append(PinProblem(f"output.{output.name}", why, next_step))
            continue
        found[output.name] = place
        periods.setdefault(place.timer, (Period.of(output, place), output.name))
    return found, failed


def _place(
    output: Output, taken: dict[int, str], periods: dict[int, tuple[Period, str]], used: list[TimerOutput]
) -> tuple[TimerOutput | None, str]:
    """The timer channel for an output (or None), and why there is none."""
    why = [f"{output.pin} has no timer for pulses"]
    for place in TIMER_OUTPUTS.get(output.pin, ()):
        period, first = periods.get(place.timer, (Period.of(output, place), ""))
        if place.timer in taken:
            why.append(f"timer {place.timer} of {output.pin} is taken by the engine for {taken[place.timer]}")
        elif place in used:
            why.append(f"channel {place.channel} of timer {place.timer} is taken by another output")
        elif period != Period.of(output, place):
            why.append(f"timer {place.timer} of {output.pin} has another frequency, for output.{first}")
        else:
            return place, ""
    return None, why[-1]


class SharedChannel(NamedTuple):
    """A channel of the board used by more than one joint."""

    key: str
    """``"motor"`` or ``"encoder"``."""
    channel: int
    joints: tuple[str, ...]


def shared(joints: Iterable[Joint]) -> list[SharedChannel]:
    """Channels used by more than one joint; empty for those of a valid arm."""
    users: dict[tuple[str, int], list[str]] = defaultdict(list)
    for joint in joints:
        for key, part in (("motor", joint.motor), ("encoder", joint.encoder)):
            if part is not None:
                users[key, part.channel].append(joint.name)
    return [SharedChannel(*place, tuple(names)) for place, names in users.items() if len(names) > 1]
