"""Cubics: how many steps are a group, within which time grows evenly, under CPython."""

from __future__ import annotations

import importlib
import random
from array import array
from collections.abc import Iterator
from dataclasses import dataclass
from math import frexp
from types import ModuleType

import pytest

from tests import inprocess

SEED = 20261124
CASES = 300
TIME_SCALE = 8
ALLOWED_TICKS = 3 / 32
LONGEST = 16
MANTISSA_BITS = 29
ITEM_WORDS = 13


@dataclass(frozen=True)
class Modules:
    """What is tested, and the names of the words that it works on."""

    cubics: ModuleType
    newton: ModuleType
    queue: ModuleType


@pytest.fixture(scope="module")
def board() -> Iterator[Modules]:
    with inprocess.board_modules():
        yield Modules(
            *(
                importlib.import_module(f"armtempo_board.stepgen.{name}")
                for name in ("cubics", "newton", "step_queue")
            )
        )


def put_node(board: Modules, solver: array[int], node: int, ticks: float, slope: float) -> None:
    """A node at a time, with so many ticks per step."""
    fraction, power = frexp(slope)
    solver[node + board.newton.NODE_TIME] = round(ticks * (1 << TIME_SCALE))
    solver[node + board.newton.NODE_MANTISSA] = round(fraction * (1 << MANTISSA_BITS))
    solver[node + board.newton.NODE_EXPONENT] = MANTISSA_BITS - power


def group_of(board: Modules, steps: int, slopes: tuple[float, float], ticks: float) -> int:
    """Steps in a group of the cubic that takes so many ticks, from one slope to the other."""
    solver = array("i", bytes(4 * board.newton.SOLVER_SIZE))
    queue = array("i", bytes(4 * board.queue.QUEUE_SIZE))
    queue[board.queue.TIME_SCALE] = TIME_SCALE
    put_node(board, solver, board.newton.FIRST_NODE, 0.0, slopes[0])
    put_node(board, solver, board.newton.MIDDLE_NODE, ticks, slopes[1])
    put_node(board, solver, board.newton.END_NODE, ticks + steps * slopes[1], slopes[1])
    board.cubics.put_cubics(steps, solver, queue, 0)
    assert queue[board.queue.IN] == 2
    first_item = board.queue.QUEUE_SIZE - ITEM_WORDS * board.queue.CAPACITY
    return queue[first_item + board.queue.GROUP]


def error_ticks(steps: int, slopes: tuple[float, float], ticks: float, group: int) -> float:
    """The most that a chord over a group leaves the cubic: its second derivative is greatest at an end."""
    bend = (slopes[1] - slopes[0]) * steps
    missing = ticks - slopes[0] * steps
    square, cubic = 3 * missing - bend, bend - 2 * missing
    second = max(abs(2 * square), abs(2 * square + 6 * cubic)) / steps**2
    return second * group**2 / 8


def rounding_ticks(steps: int, slopes: tuple[float, float], group: int) -> float:
    """The second derivative is rounded up to the unit in which the cubic is computed: what that adds to the error."""
    unit = 2.0 ** (frexp(max(slopes))[1] + (steps - 1).bit_length() - MANTISSA_BITS)
    return unit * group**2 / 8


def test_a_group_is_as_long_as_time_grows_evenly_in_it(board: Modules) -> None:
    """Within 3/32 tick; a group of twice the length would not do."""
    random.seed(SEED)
    found = set()
    for _ in range(CASES):
        steps = random.randrange(8, 400)
        first = random.uniform(400.0, 4000.0)
        slopes = (first, first + random.choice((-1, 1)) * 10 ** random.uniform(-2.0, 1.6))
        even = steps * (slopes[0] + slopes[1]) / 2
        ticks = even + random.uniform(-0.15, 0.15) * steps * (slopes[1] - slopes[0])
        group = group_of(board, steps, slopes, ticks)
        found.add(group)
        case = f"{steps} steps, slopes {slopes}, {ticks} ticks: {group}"
        assert group == 1 or error_ticks(steps, slopes, ticks, group) <= 1.01 * ALLOWED_TICKS, case
        if 2 * group <= min(LONGEST, steps):
            twice = error_ticks(steps, slopes, ticks, 2 * group) + rounding_ticks(steps, slopes, 2 * group)
            assert twice > 0.99 * ALLOWED_TICKS, case
    assert found == {1, 2, 4, 8, 16}
