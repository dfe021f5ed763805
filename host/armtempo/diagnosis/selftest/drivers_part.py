"""Whether the drivers are off: from the level of ENABLE, and from encoders that do not turn while STEP toggles."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from armtempo.diagnosis.finding import Level
from armtempo.diagnosis.selftest.result import Measurement, judged, left_out

DRIVERS = "drivers"
_STILL = 2
"""Counts, as in ``board: selftest/encoders.py``."""


def judge(found: dict[str, Any]) -> Iterator[Measurement]:
    """The line about ``found`` of ``board: selftest/drivers.py``."""
    if found["active"] is None:
        yield left_out(
            DRIVERS,
            "no arm is configured, so the level that switches drivers off is unknown; no pulses were made",
            "run 'armtempo configure' with your arm file, then the self-test again",
        )
        return
    yield off_line("ENABLE (PE12)", found["active"], _state(found))


def off_line(what: str, active: int, state: Sequence[int]) -> Measurement:
    """``state`` of ENABLE: is an output, output level, level of the pin; ``active``: level with drivers on."""
    level = "high" if state[2] else "low"
    return judged(
        DRIVERS,
        what,
        f"{level}, {'driven' if state[0] else 'not driven'}",
        f"{'low' if active else 'high'}, driven",
        _off(active, state),
        "take power from the drivers, look for a short at PE12; no pulses were made",
    )


def is_on(found: dict[str, Any]) -> bool:
    """Whether ENABLE is driven and active."""
    return found["active"] is not None and found["output"] and found["level"] == found["active"]


def is_off(found: dict[str, Any]) -> bool:
    """Whether ENABLE is driven to its inactive level, and has it."""
    return found["active"] is not None and _off(found["active"], _state(found))


def _state(found: dict[str, Any]) -> tuple[int, int, int]:
    return found["output"], found["driven"], found["level"]


def _off(active: int, state: Sequence[int]) -> bool:
    return bool(state[0] and state[1] == state[2] == 1 - active)


def judge_encoders(found: dict[str, Any]) -> Iterator[Measurement]:
    """Lines about ``found`` of ``board: selftest/encoders.py``; the first determines whether more pulses are made."""
    turned = {number: counts for number, counts in enumerate(found["turned"], 1) if counts is not None}
    moved = [
        f"joint {number} turned {counts} counts" for number, counts in turned.items() if abs(counts) > _STILL
    ]
    yield judged(
        DRIVERS,
        "encoders while STEP toggles",
        ", ".join(moved) or "all stand still",
        "all stand still",
        not moved,
        "the drivers are on though ENABLE (PE12) is inactive: take their power off, check ENABLE's wire and "
        "enable_active in the arm file; no more pulses were made",
    )
    blind = [
        str(number) for number, due in enumerate(found["due"], 1) if number not in turned or due <= _STILL
    ]
    if blind and not moved:
        yield Measurement(
            DRIVERS, "joints whose encoder cannot tell", ", ".join(blind), "", Level.NOTE,
            "keep their motors without power unless you know that ENABLE switches their drivers off",
        )  # fmt: skip
