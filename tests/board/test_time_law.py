"""The law of real time at a constant rate: times of steps against exact arithmetic, under CPython."""

from __future__ import annotations

import importlib
import random
from array import array
from collections.abc import Iterator
from fractions import Fraction
from types import ModuleType

import pytest
from armtempo_shared.motion import RAMP_SHAPES

from tests import inprocess, ramps

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


def test_ramps_of_every_shape(modules: tuple[ModuleType, ModuleType]) -> None:
    """Rate and motion's time at any place of a ramp to 10 / 2**30, and the place again from the motion's time."""
    _, time_law = modules
    random.seed(SEED)
    law = array("i", bytes(4 * time_law.LAW_WORDS))
    for shape in range(len(RAMP_SHAPES)):
        first, second = RAMP_SHAPES[shape] & 15, RAMP_SHAPES[shape] >> 4
        rise = ramps.rise(shape)
        way = rise.antiderivative()
        assert 1 <= first < second <= 15
        assert min(rise.derivative()([first / 16, second / 16])) >= 0
        for place in (*random.choices(range(1 << 30), k=12), 7, first << 26, second << 26, (1 << 30) - 1):
            before, after = random.choice(
                [(1000, 0), (0, 1000), (random.randrange(1001), random.randrange(1001))]
            )
            time_law.set_ramp(law, shape, before, after)
            least, change = min(before, after) / 1000, abs(after - before) / 1000
            rate = least + change * rise(place / 2**30)
            time_law._evaluate(law, place, -1)
            case = f"seed {SEED}: shape {first} {second}, {before} to {after}, {place}"
            assert abs(law[time_law._SLOPE] - rate * 2**30) <= 10, case
            assert abs(law[time_law._VALUE] - (least * place + change * way(place / 2**30) * 2**30)) <= 10, (
                case
            )
            if rate > 0.01:
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
