"""The highest step rates at which the board keeps up, against what it states."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from armtempo_shared.limits import MAX_STEP_RATE, MAX_STEP_RATE_SUM

from armtempo.selftest.result import Measurement, judged

PART = "rates"
JOINTS = (1, 2, 3, 6)
DURATION_S = 0.4
_ABOVE = 1.01
"""The rate that is allowed is this much above the one that is wanted, so that rounding does not exceed it."""
_ROUNDS = 5


def limit(rate: int) -> int:
    """The joint's limit in the arm record for a motion that reaches ``rate``."""
    return min(round(rate * _ABOVE), MAX_STEP_RATE)


def stated(count: int) -> int:
    """What the board allows each of ``count`` joints, less the rounding."""
    return int(min(MAX_STEP_RATE, MAX_STEP_RATE_SUM // count) / _ABOVE**2)


def highest(keeps_up: Callable[[int], bool | None], count: int) -> int | None:
    """By bisection below what is stated, to about 3 % of it; None where it could not be tried."""
    good, bad = 0, stated(count)
    answer = keeps_up(bad)
    if answer or answer is None:
        return bad if answer else None
    for _ in range(_ROUNDS):
        middle = (good + bad) // 2
        good, bad = (middle, bad) if keeps_up(middle) else (good, middle)
    return good


def judge(rate: int | None, count: int) -> Iterator[Measurement]:
    """The line about the rate that was found for that many joints."""
    if rate is None:
        return
    joints = "1 joint" if count == 1 else f"{count} joints, each"
    yield judged(
        PART,
        f"highest step rate without an underrun, {joints}",
        f"{rate} steps/s",
        f"{stated(count)}, as the board states",
        rate >= stated(count),
        f"keep max_speed and microsteps such that {joints} stays below {round(0.8 * rate)} steps/s",
    )
