"""A subinterval's steps, solved: times and slopes against the exact polynomials, under CPython."""

from __future__ import annotations

import importlib
import random
from array import array
from collections.abc import Iterator
from types import ModuleType

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from tests import inprocess

SEED = 20261123
CASES = 60
BITS = 25
"""Of the differences: their sum stays below 2**28."""
TIME_UNITS = 4.0
SLOPE_PART = 2.0**-22


@pytest.fixture(scope="module")
def newton() -> Iterator[ModuleType]:
    with inprocess.board_modules():
        yield importlib.import_module("armtempo_board.stepgen.newton")


def differences() -> list[int]:
    """Of neighbouring Bezier points: within a factor of two of each other."""
    least = random.randrange(1 << BITS - 2, 1 << BITS - 1)
    return [random.randrange(least, 2 * least) for _ in range(5)]


def polynomial(steps: list[int]) -> Polynomial:
    """The quintic over [0, 1] from 0 whose Bezier points differ by these."""
    b = [0, *np.cumsum(steps)]
    powers = [
        b[0],
        5 * (b[1] - b[0]),
        10 * (b[2] - 2 * b[1] + b[0]),
        10 * (b[3] - 3 * b[2] + 3 * b[1] - b[0]),
        5 * (b[4] - 4 * b[3] + 6 * b[2] - 4 * b[1] + b[0]),
        b[5] - 5 * b[4] + 10 * b[3] - 10 * b[2] + 5 * b[1] - b[0],
    ]
    return Polynomial([float(power) for power in powers])


def place_of(angle: Polynomial, target: float) -> float:
    """Where it is reached: the polynomial rises."""
    low, high = 0.0, 1.0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if angle(middle) < target else (low, middle)
    return low


def measures(newton: ModuleType, scale: int, steps: list[int], sign: int = 1) -> array[int]:
    return array("i", [scale, *(sign * step + newton._BIAS for step in steps), *[0] * 6])


@pytest.mark.parametrize("sign", [1, -1])
def test_times_and_slopes_are_those_of_the_polynomials(newton: ModuleType, sign: int) -> None:
    """Of rising and falling subintervals: single steps, and two at a time as the queue asks for them."""
    random.seed(SEED)
    for number in range(CASES):
        angle_scale, time_scale = random.randrange(12, 24), random.randrange(12, 24)
        angle_steps, time_steps = differences(), differences()
        angle, time = polynomial(angle_steps), polynomial(time_steps)
        solver = array("i", bytes(4 * newton.SOLVER_SIZE))
        solver[newton.TARGET] = (1 << 28) + sign  # half a step from the first point's whole one, which is
        low = random.randrange(1 << 27)  # so much of a step after it
        solver[newton.TIME_OFFSET] = offset = random.randrange(1 << 20)
        newton.set_interval(
            solver,
            array("i", [*[0] * newton._LOW, low, *[0] * 5]),
            measures(newton, angle_scale, angle_steps, sign),
            measures(newton, time_scale, time_steps),
        )
        assert solver[newton.RANGE] == angle(1.0)
        last = (solver[newton.RANGE] >> angle_scale) - 1
        length = max(last // 8, 1)
        newton.solve(solver, 0, 0)
        newton.solve(solver, 0, length)
        for index, node in (
            (0, newton.FIRST_NODE),
            (length, newton.MIDDLE_NODE),
            (2 * length, newton.END_NODE),
        ):
            case = f"seed {SEED}, case {number}, step {index}"
            w = place_of(angle, (index + 0.5 - sign * low / 2**28) * 2**angle_scale)
            late = solver[node + newton.NODE_TIME] - offset - time(w)
            assert abs(late) <= TIME_UNITS, f"{case}: {late} units late"
            slope = solver[node + newton.NODE_MANTISSA] / 2.0 ** solver[node + newton.NODE_EXPONENT]
            exact = time.deriv()(w) / angle.deriv()(w) * 2.0 ** (12 - time_scale + angle_scale)
            assert abs(slope / exact - 1) <= SLOPE_PART, f"{case}: slope {slope}, not {exact}"
