"""The times of the edges on the STEP pins in a motion."""

from binascii import hexlify, unhexlify

import stm
from machine import mem32
from micropython import const

from armtempo_board.selftest.bare_engine import load, make_engine, serve
from armtempo_board.selftest.capture import begin, captured, end
from armtempo_board.selftest.common import count_cycles, cycles, enable, feed, free

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

_WORDS = const(32)  # of bulk data in a line


def directions(joints: "list[dict[str, int]]") -> "list[int]":
    """Levels of the joints' DIR pins."""
    from armtempo_board.hardware import pins

    found = []
    for joint in joints:
        pin = pins.DIR[joint["channel"]]
        found.append(mem32[getattr(stm, "GPIO" + pins.port(pin)) + stm.GPIO_IDR] >> pins.line(pin) & 1)
    return found


def measure(
    record: str, motion: str, start_steps: "list[int]", rates: "list[int]", idle_us: int, most: int
) -> "dict[str, Any]":
    """Run the motion (a record in hex) once; up to ``most`` edges are sent as bulk data, 4 bytes each, by port."""
    feed()
    count_cycles()
    captures, steps = captured(record, len(start_steps), most)
    engine, joints = make_engine(record, rates=rates)
    stages = {"engine": free()}
    longest = passes = 0
    try:
        load(engine, unhexlify(motion), start_steps)
        stages["loaded"] = free()
        begin(captures)
        engine.start()
        then = begun = cycles()
        while engine.moving:
            serve(engine, idle_us)
            for capture in captures:
                capture.look()
            now = cycles()
            longest = max(longest, (now - then) & 0xFFFFFFFF)
            then = now
            passes += 1
        passed = (cycles() - begun) & 0xFFFFFFFF
        turned = directions(joints)
        for capture in captures:
            capture.look()
        stages["moved"] = free()
    finally:
        engine.freeze()
        end(captures)
        off = enable()
        engine.close()
    for capture in captures:
        data = memoryview(capture.edges)[: min(capture.count(), most)]
        for at in range(0, len(data), _WORDS):
            print("#" + hexlify(data[at : at + _WORDS]).decode())  # type: ignore[arg-type]
    return {
        "fault": engine.fault,
        "ports": [capture.name for capture in captures],
        "counts": [capture.count() for capture in captures],
        "steps": steps,
        "directions": turned,
        "passes": passes,
        "pass_cycles": passed // max(passes, 1),
        "longest_pass_cycles": longest,
        "free": stages,
        "enable": off,
    }
