"""The law of real time at a constant rate: times of steps against exact arithmetic, under CPython."""

from __future__ import annotations

import importlib
import random
from array import array
from collections.abc import Iterator
from fractions import Fraction
from itertools import combinations
from types import ModuleType

import pytest

from tests import inprocess

SEED = 20261123
CASES = 300
BIAS = 1 << 28
HIGH_TICKS = 1 << 12
"""What a high word of time counts."""
FRACTION = Fraction(1, 1 << 10)
"""Ticks of the motion to which the law works."""


@pytest.fixture(scope="module")
def modules() -> Iterator[tuple[ModuleType, ModuleType]]:
    with inprocess.board_modules():
        yield tuple(  # type: ignore[misc]
            importlib.import_module(f"armtempo_board.stepgen.{name}") for name in ("override", "time_law")
        )


def test_times_at_a_constant_rate(modules: tuple[ModuleType, ModuleType]) -> None:
    """Whatever part of a tick the times of a subinterval are told to."""
    overrides, time_law = modules
    random.seed(SEED)
    for number in range(CASES):
        rate, scale = random.randrange(10, 1000), random.randrange(1, 22)
        high, time = random.randrange(1 << 20), random.randrange(1 << 28)
        override = overrides.Override()
        override.begin(rate, None, 1 << 38)
        words = array("i", bytes(4 * time_law.LAW_WORDS))
        law = overrides.JointLaw(words)
        real_high = law.take(override.law, BIAS + high) - BIAS
        node = array("i", bytes(32))
        node[time_law._NODE_TIME] = time
        assert time_law.to_real_time(words, node, 0, scale) == 1
        part = Fraction(node[time_law._NODE_TIME], 1 << scale)
        found = real_high * HIGH_TICKS + node[time_law._NODE_DELAY] + part
        exact = (high * HIGH_TICKS + Fraction(time, 1 << scale)) * 1000 / rate
        allowed = FRACTION * 1000 / rate + FRACTION + Fraction(1, 1 << scale)
        case = f"seed {SEED}, case {number}: rate {rate}, scale {scale}"
        assert abs(found - exact) <= allowed, f"{case}: {float(found - exact)} ticks late"
        assert 0 <= part < 1, case
        assert node[time_law._NODE_RATE] == pytest.approx(rate * 2**30 / 1000, abs=2), case


def exact_ramp(shape: int, r: Fraction) -> tuple[Fraction, Fraction]:
    """S and e at r: the slope is linear between 0, p/16, q/16 and 1, and e(1) the best multiple of 1/64."""
    first, second = Fraction(shape & 15, 16), Fraction(shape >> 4, 16)
    whole = Fraction(round(64 * (3 - first - second - (1 - first) / (1 + second - first)) / 3), 64)
    late = 3 - first - second - 3 * whole
    slopes = [Fraction(0), 2 * (1 - late) / second, 2 * late / (1 - first), Fraction(0)]
    rise = way = start = Fraction(0)
    for end, before, after in zip((first, second, Fraction(1)), slopes[:-1], slopes[1:], strict=True):
        x = min(max(r - start, Fraction(0)), end - start)
        bend = (after - before) / (end - start)
        way += x * (rise + x * (before / 2 + x * bend / 6))
        rise += x * (before + x * bend / 2)
        start = end
    return rise, way


def test_ramps_of_every_shape(modules: tuple[ModuleType, ModuleType]) -> None:
    """Rate and motion's time at any place of a ramp to 10 / 2**30, and the place again from the motion's time."""
    _, time_law = modules
    random.seed(SEED)
    law = array("i", bytes(4 * time_law.LAW_WORDS))
    for first, second in combinations(range(1, 16), 2):
        shape = first + 16 * second
        assert exact_ramp(shape, Fraction(1)) == (1, Fraction(time_law.way_64ths(shape), 64))
        for place in (*random.choices(range(1 << 30), k=3), 7, first << 26, second << 26, (1 << 30) - 1):
            before, after = random.choice(
                [(1000, 0), (0, 1000), (random.randrange(1001), random.randrange(1001))]
            )
            time_law.set_ramp(law, shape, before, after)
            least, change = Fraction(min(before, after), 1000), Fraction(abs(after - before), 1000)
            rise, way = exact_ramp(shape, Fraction(place, 1 << 30))
            rate = least + change * rise
            time_law._evaluate(law, place, -1)
            case = f"seed {SEED}: shape {first} {second}, {before} to {after}, {place}"
            assert abs(law[time_law._SLOPE] - rate * 2**30) <= 10, case
            assert abs(law[time_law._VALUE] - (least * place + change * way * 2**30)) <= 10, case
            if rate > Fraction(1, 100):
                again = time_law._evaluate(law, (1 << 30) - 1, law[time_law._VALUE])
                assert abs(again - place) * rate <= 10, case


def test_shares_of_a_ramp(modules: tuple[ModuleType, ModuleType]) -> None:
    """Of any length; from 3.2 s on it is counted in more than one tick. There and back again."""
    _, time_law = modules
    random.seed(SEED)
    for number in range(CASES):
        grid = time_law.RAMP_GRID_TICKS
        length = grid * random.randrange(1, (time_law.LONGEST_RAMP_TICKS >> random.randrange(10)) // grid)
        ticks, scale = random.randrange(length), random.randrange(22)
        fraction = random.randrange(1 << scale)
        law = array("i", bytes(4 * time_law.LAW_WORDS))
        time_law.set_length(law, length)
        share = time_law._share(law, ticks, fraction, scale)
        case = f"seed {SEED}, case {number}: {ticks} ticks of {length}"
        assert abs(share - Fraction(ticks * 2**scale + fraction, length * 2**scale) * 2**30) <= 4, case
        rest = time_law._ticks_of(law, share)
        found = law[time_law._VALUE] + Fraction(rest, 1 << 15)
        assert abs(found - Fraction(share * length, 2**30)) <= FRACTION, case
