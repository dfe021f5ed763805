"""How long outputs continue after E-stop and limit switch: by software (EXTI_SWIER, RM0090 12.3.5), by a real edge."""

import time
from binascii import unhexlify

import stm
from machine import mem32

from armtempo_board.hardware.isr import FROZEN
from armtempo_board.selftest.bare_engine import load, make_engine, pull_inactive, pulls, serve
from armtempo_board.selftest.common import count_cycles, cycles, enable, feed

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

_STARVE_US = 40_000
_MOST_LOOKS = 100


def stopped(engine: "Any", at: int, value: int) -> int:
    """Cycles from writing a register until the input's interrupt has ended; -1 if the outputs continue."""
    block = engine.block
    looks = 0
    before = cycles()
    mem32[at] = value
    while True:
        frozen = block[FROZEN]
        after = cycles()
        looks += 1
        if frozen:
            return (after - before) & 0xFFFFFFFF
        if looks == _MOST_LOOKS:
            return -1


def cost_of_looking(engine: "Any", at: int, value: int) -> int:
    """The same if nothing has to be waited for, and nothing is triggered."""
    engine.block[FROZEN] = 1
    fewest = min([stopped(engine, at, value) for _ in range(5)])
    engine.block[FROZEN] = 0
    return fewest


def serve_for(engine: "Any", wait_us: int, idle_us: int) -> None:
    """Passes of the loop for so long."""
    then = time.ticks_us()
    while time.ticks_diff(time.ticks_us(), then) < wait_us:
        serve(engine, idle_us)


def triggers(engine: "Any") -> "dict[str, tuple[int, int, int, int]]":
    """By name, what stops the outputs: (register, value that trips, value afterwards, fault that is due).

    An edge only if the pull resistor moves the input, as nothing is wired to it; a limit switch that is pressed is
    left out.
    """
    from armtempo_shared import codes

    from armtempo_board.hardware import pins

    inputs = engine.inputs
    found = {}
    limit, limit_level, *_ = inputs._limits[0]
    for name, pin, switch, level, fault in (
        ("E-stop", pins.ESTOP, inputs._estop, inputs._estop_level, codes.ESTOP),
        ("limit switch", pins.LIMIT[0], limit, limit_level, codes.LIMIT_SWITCH),
    ):
        at, trip, rest = pulls(pin, level)
        levels = []
        for value in (trip, rest):
            mem32[at] = value
            time.sleep_ms(1)
            levels.append(switch.value())
        tripped, rested = levels
        if rested == level:
            inputs._limits = []
            continue
        found[name + " by software"] = stm.EXTI + stm.EXTI_SWIER, 1 << pins.line(pin), 0, fault
        if tripped == level:
            found[name + " by an edge"] = at, trip, rest, fault
    pull_inactive(engine)
    return found


def starve(
    engine: "Any", joints: "list[dict[str, int]]", motion: bytes, start_steps: "list[int]", idle_us: int
) -> "dict[str, Any]":
    """What becomes of a motion that lasts longer if the interrupt that fills the rings is held off (TIM6 stops)."""
    from armtempo_board.hardware import pins

    load(engine, motion, start_steps)
    engine.start()
    serve_for(engine, _STARVE_US, idle_us)
    mem32[stm.TIM6] = 0
    while engine.moving:
        serve(engine, idle_us)
    high = 0
    for joint in joints:
        pin = pins.STEP[joint["channel"]][0]
        high |= mem32[getattr(stm, "GPIO" + pins.port(pin)) + stm.GPIO_IDR] >> pins.line(pin) & 1
    end = {"fault": engine.fault, "low": not high, "known": engine.known == (1 << len(start_steps)) - 1}
    engine.clear()
    return end


def measure(
    record: str,
    motions: "list[str]",
    start_steps: "list[int]",
    rates: "list[int]",
    waits_us: "list[int]",
    idle_us: int,
) -> "dict[str, Any]":
    """Cycles of each trial by its trigger, less the reading of the counter; how often another fault came than is due.

    The triggers take turns. ``motions``: that of the trials, and the one in which the rings run dry, from step 0.
    """
    feed()
    count_cycles()
    engine, joints = make_engine(record, True, rates)
    motion, starved = [unhexlify(one) for one in motions]
    wrong = 0
    try:
        found = triggers(engine)
        names = sorted(found)
        nothing = {name: cost_of_looking(engine, at, rest) for name, (at, _, rest, _) in found.items()}
        took: "dict[str, list[int]]" = {name: [] for name in names}
        for number, wait_us in enumerate(waits_us):
            name = names[number % len(names)]
            at, trip, rest, due = found[name]
            load(engine, motion, start_steps)
            engine.skip_check = True  # the next ones are the same motion
            engine.start()
            serve_for(engine, wait_us, idle_us)
            cycles_taken = stopped(engine, at, trip)
            mem32[at] = rest
            took[name].append(max(cycles_taken - nothing[name], -1))
            while engine.moving:
                serve(engine, idle_us)
            wrong += engine.fault != due
            engine.clear()
            feed()
        engine.skip_check = False
        end = starve(engine, joints, starved, [0] * len(rates), idle_us)
    finally:
        engine.freeze()
        off = enable()
        engine.close()
    return {"cycles": took, "wrong_faults": wrong, "starved": end, "enable": off}
