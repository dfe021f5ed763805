"""An engine for the board's arm without its drivers, for the parts that make steps."""

import gc
import time

import stm
from armtempo_shared import armrecord
from machine import mem32

from armtempo_board.selftest.common import enable

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from armtempo_shared.motion import Motion

    from armtempo_board.motion.engine import Engine


class NoPin:
    """Replaces ENABLE, so that the engine cannot switch the drivers on; it reads as ``off``."""

    def __init__(self, off: int) -> None:
        self._off = off

    def value(self, level: "int | None" = None) -> int:
        """Only this."""
        return self._off


_SEEN_TICKS = 168  # 2 us: two samples of a capture at 1 MHz
_RANGE = 1 << 24  # steps; with the drivers off a joint can go anywhere


def make_engine(
    record: str,
    switches: bool = False,
    rates: "list[int] | None" = None,
    encoders: bool = False,
    engine_memory: "Any" = None,
) -> "tuple[Engine, list[dict[str, int]]]":
    """(engine, rows of its joints); it only steps the pins of this arm, and the arm's E-stop stops it.

    ``switches``: with E-stop and limit switch 1 for the first joint, whatever the arm has. ``rates``: of this number of
    joints, instead of the arm's, without ranges. ``encoders``: read them, without a check of the following error.
    ``engine_memory``: that of a running program.
    """
    from armtempo_board.app import memory_shares
    from armtempo_board.motion.engine import Engine
    from armtempo_board.motion.engine_parts import EngineParts

    with open(record, "rb") as file:
        head, joints, _ = armrecord.unpack(file.read())
    kept = armrecord.FLAG_ENABLE_HIGH | armrecord.FLAG_ESTOP_ACTIVE_HIGH | armrecord.FLAG_ESTOP_FITTED
    head["flags"] = head["flags"] & kept | (armrecord.FLAG_ESTOP_FITTED if switches else 0)
    head["pulse_ticks"] = max(head["pulse_ticks"], _SEEN_TICKS)
    for joint in joints:
        joint["limit_low"] = joint["limit_high"] = armrecord.NONE
        joint["following_counts"] = 0
        if not encoders:
            joint["encoder"] = armrecord.NONE
    if switches:
        joints[0]["limit_high"] = 0
    if rates:
        joints = joints[: len(rates)]
        for joint, rate in zip(joints, rates):
            joint["max_rate"], joint["min_steps"], joint["max_steps"] = rate, -_RANGE, _RANGE
    if engine_memory is None:
        engine_memory = memory_shares.for_engine()
    else:
        memory_shares.resize(engine_memory, len(joints))
    engine = Engine(EngineParts(head, joints, engine_memory))
    engine.inputs.enable_pin = NoPin(1 - engine.inputs.on_level)  # type: ignore[assignment]
    if head["flags"] & armrecord.FLAG_ESTOP_FITTED:
        pull_inactive(engine)
    return engine, joints


def pulls(pin: str, level: int) -> "tuple[int, int, int]":
    """(register, value to pull an input to a level, value for the other level) of its pull resistor."""
    from armtempo_board.hardware import pins

    at = getattr(stm, "GPIO" + pins.port(pin)) + stm.GPIO_PUPDR
    shift = 2 * pins.line(pin)
    others = mem32[at] & ~(3 << shift)
    down_up = others | 2 << shift, others | 1 << shift
    return at, down_up[level], down_up[1 - level]


def pull_inactive(engine: "Any") -> None:
    """Pull the E-stop's input to its inactive level, in case it is not wired; a switch is stronger.

    Raises ValueError if it is pressed.
    """
    from armtempo_board.hardware import pins

    at, _, rest = pulls(pins.ESTOP, engine.inputs._estop_level)
    mem32[at] = rest
    time.sleep_ms(1)
    engine.service()  # takes earlier trips
    if not engine.clear():
        engine.close()
        raise ValueError("the E-stop is pressed, or wired for the other level")


def serve(engine: "Engine", idle_us: int) -> None:
    """A pass of the loop. ``idle_us``: its duration in simulated time."""
    engine.service()
    if idle_us:
        time.sleep_us(idle_us)


def load(engine: "Any", motion: bytes, start_steps: "list[int]") -> "Motion":
    """Declare the joints at the motion's start and load it; returns it. ValueError if the drivers are not off."""
    from armtempo_shared.motion import Motion

    output, driven, level = enable()
    if not output or driven != level or level == engine.inputs.on_level:
        raise ValueError("ENABLE is not inactive: no steps are made")
    engine.home((1 << len(start_steps)) - 1, start_steps)
    found = Motion(motion)
    engine.load(found)
    gc.collect()
    return found
