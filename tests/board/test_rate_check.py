"""Step rates of subintervals against a limit: the arithmetic by itself, under CPython."""

from __future__ import annotations

import importlib
import random
from array import array
from types import ModuleType, SimpleNamespace

import pytest
from armtempo_shared.limits import TICK_HZ

from tests import inprocess

SEED = 20261123
LEAST_TICKS, MOST_TICKS = 1 << 20, 1 << 28
ROUNDED = 8
"""Steps, of the differences' own unit, that the comparison may be off."""


@pytest.fixture(scope="module")
def rate_check() -> ModuleType:
    with inprocess.board_modules():
        return importlib.import_module("armtempo_board.motion.rate_check")


def compared(rate_check: ModuleType, steps: list[int], ticks: list[int], rate: int) -> int:
    """Differences of five Bezier points each, at the scale at which a tick of time is one of theirs."""
    mantissa, exponent = rate_check.scaled(rate)
    angle, time = (
        array("I", [0, *(each + rate_check.DIFFERENCE_BIAS for each in row)]) for row in (steps, ticks)
    )
    return int(rate_check.compare(angle, time, mantissa, 30 - exponent))


def test_a_rate_just_within_and_just_beyond_the_limit(rate_check: ModuleType) -> None:
    """All differences at the limit, either way; then one beyond it: at an end that is certain, within it is not."""
    random.seed(SEED)
    for _ in range(200):
        rate = random.randrange(TICK_HZ // 1000, TICK_HZ // 4)
        ticks = [random.randrange(LEAST_TICKS, MOST_TICKS) for _ in range(5)]
        steps = [random.choice((-1, 1)) * (each * rate // TICK_HZ) for each in ticks]
        assert compared(rate_check, steps, ticks, rate) == rate_check.SLOWER, (SEED, rate, ticks)
        place = random.randrange(5)
        steps[place] += ROUNDED if steps[place] > 0 else -ROUNDED
        beyond = rate_check.FASTER if place in (0, 4) else rate_check.UNDECIDED
        assert compared(rate_check, steps, ticks, rate) == beyond, (SEED, rate, ticks, place)


def interval(rate_check: ModuleType, steps: list[int], ticks: list[int]) -> SimpleNamespace:
    """A subinterval whose differences of angle count 2**-10 steps each, those of time 2**-10 ticks."""
    measured = [
        [scale, *(each + rate_check.DIFFERENCE_BIAS for each in (*row, min(row), max(row)))]
        for scale, row in ((10, steps), (22, ticks))
    ]
    return SimpleNamespace(angle_measures=measured[0], time_measures=measured[1])


def test_the_rate_that_is_told(rate_check: ModuleType) -> None:
    """At its ends the greater of the two; else the largest difference of angle over the smallest of time."""
    ticks = [1 << 20] * 5
    for steps in ([1024, 2048, 5000, 2048, -3072], [3072, 2048, -5000, 2048, 1024]):
        found = interval(rate_check, steps, ticks)
        assert rate_check.at_ends(found) == 3072 * TICK_HZ >> 20
        assert rate_check.highest(found) == 5000 * TICK_HZ >> 20
    ticks[2] = 1 << 19
    assert rate_check.highest(interval(rate_check, steps, ticks)) == 5000 * TICK_HZ >> 19


def test_time_that_does_not_advance_has_no_rate(rate_check: ModuleType) -> None:
    ticks = [LEAST_TICKS, LEAST_TICKS, -1, LEAST_TICKS, LEAST_TICKS]
    assert compared(rate_check, [0] * 5, ticks, TICK_HZ // 4) == rate_check.UNDECIDED
