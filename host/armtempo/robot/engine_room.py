"""Does the engine for an arm fit into the board's memory? By the board's own formula, before anything is sent."""

from __future__ import annotations

from armtempo_shared import engine_memory

from armtempo.errors import InputError
from armtempo.link.board_messages import Hello
from armtempo.model.arm import Arm
from armtempo.records import encode

_FIRMWARE = "or put the program into the board's firmware, which leaves more memory (board/docs/firmware.md)"


def check(arm: Arm, info: Hello) -> None:
    """InputError with the bytes needed, the bytes there and what to do, where the engine for the arm does not fit."""
    rates = encode.step_rates(arm)
    if len(rates) > info.engine_joints:
        raise InputError(
            f"arm {arm.name!r} drives {len(rates)} joints; the board has memory for {info.engine_joints}",
            f"drive fewer joints, {_FIRMWARE}",
        )
    if not engine_memory.fits(rates, info.engine_room // 4):
        raise InputError(
            f"arm {arm.name!r} needs {4 * engine_memory.words(rates)} bytes for its engine, the board has "
            f"{info.engine_room}",
            f"lower its top speeds (its joints step up to {', '.join(map(str, rates))} steps/s; "
            f"slower ones have smaller rings), drive fewer joints, {_FIRMWARE}",
        )


def words(info: Hello) -> str:
    """What fits, for ``status`` and ``deploy``: joints, steps/s and bytes."""
    return f"{info.engine_room} bytes: {', '.join(_fitting(info)) or 'no arm fits'}"


def _fitting(info: Hello) -> list[str]:
    found = []
    for joints in range(1, info.engine_joints + 1):
        rate = _highest_rate(joints, info)
        if rate:
            found.append(f"{joints} x {rate} steps/s")
    return found


def _highest_rate(joints: int, info: Hello) -> int:
    """The highest step rate, in whole 1000 steps/s, at which so many joints fit; 0 where none do."""
    for rate in range(info.max_rate_sum // joints // 1000, 0, -1):
        if engine_memory.fits([1000 * rate] * joints, info.engine_room // 4):
            return 1000 * rate
    return 0
