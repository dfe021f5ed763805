"""Bezier points of spline segments, to the unit, under CPython."""

from __future__ import annotations

import importlib
import random
from array import array
from collections.abc import Iterator
from fractions import Fraction
from itertools import pairwise
from math import floor
from types import ModuleType

import pytest

from tests import inprocess

SEED = 20261123
CASES = 40
STEP_BITS = 28


@pytest.fixture(scope="module")
def bezier() -> Iterator[ModuleType]:
    with inprocess.board_modules():
        yield importlib.import_module("armtempo_board.stepgen.bezier")


def bezier_points(control: list[int]) -> list[Fraction]:
    """Of the segment [0, 1] of a B-spline with whole knots: its polar form at (0, ..., 0, 1, ..., 1)."""
    degree = len(control) - 1
    found = []
    for ones in range(degree + 1):
        points = [Fraction(point) for point in control]
        for level, at in enumerate([0] * (degree - ones) + [1] * ones, 1):
            knots = range(level - degree, 1)
            points = [
                left + (right - left) * Fraction(at - knot, degree + 1 - level)
                for knot, (left, right) in zip(knots, pairwise(points), strict=True)
            ]
        found += points
    return found


def test_points_of_quintics_are_rounded_to_the_nearest_unit(bezier: ModuleType) -> None:
    random.seed(SEED)
    for _ in range(CASES):
        start = random.randrange(-(1 << 50), 1 << 50)
        control = [start + random.randrange(-(1 << 48), 1 << 48) for _ in range(6)]
        data = array("i", array("q", [0, *control]).tobytes())
        piece = array("i", bytes(4 * 30))
        bezier.from_control_points(data, 2, bezier.weights(5), piece)
        for number, exact in enumerate(bezier_points(control)):
            high, low = piece[bezier.HIGH + number], piece[bezier.LOW + number]
            found = ((high - bezier.BIAS) << STEP_BITS) + low
            assert found == floor(exact + Fraction(1, 2)), f"seed {SEED}: point {number} of {control}"
