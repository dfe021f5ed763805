"""The virtual board under CPython: functions that move pointers do the same with indices instead."""

from __future__ import annotations

import importlib
import random
from array import array
from pathlib import Path
from types import FunctionType
from typing import Any

import pytest

from tests import inprocess

SEED = 20261128
FUNCTIONS = '''
from micropython import const

WIDTH = const(3)
_LAST = const(-4)
table = [7]


def rows(first: ptr32, second: ptr32, count: int) -> int:
    """Pointers that move, change places, and go back."""
    other = second
    total = 0
    while count:
        i = WIDTH
        while i:
            first[WIDTH] += other[0] * i
            total += first[WIDTH] - other[WIDTH - 1]
            i -= 1
        point = first
        first = other
        other = point
        other = ptr32(int(other) + 4 * (WIDTH - 2) - (count & 1) * 4)
        point = ptr32(int(other) + _LAST + 4)
        point[0] = total + table[0]
        count -= 1
    return total


def narrow(data: ptr8, halves: ptr16, count: int) -> int:
    """Other widths, one pointer that stays."""
    end = data
    while count:
        end = ptr8(int(end) + 1)
        halves[count] = end[0] + data[0] << 9
        count -= 1
    return halves[1]


def by_number(address: int) -> int:
    """A pointer that no argument is."""
    point = ptr32(address)
    while address:
        point = ptr32(int(point) + 4)
        address = 0
    return point[0]


def at_once(first: ptr32) -> int:
    """A pointer that moves once."""
    first = ptr32(int(first) + 4)
    return first[0]


def given_on(first: ptr32) -> int:
    """A pointer that another function gets."""
    while first[0]:
        first = ptr32(int(first) + 4)
    return at_once(first)


if table:

    def within(first: ptr32) -> int:
        """A function that is not at the begin of a line."""
        while first[0]:
            first = ptr32(int(first) + 4)
        return first[0]
'''


@pytest.fixture
def made(tmp_path: Path) -> Any:
    """Shims, rewriter, the functions above as the board program has them, its ``subdivision`` and ``bezier``."""
    with inprocess.board_modules():
        micropython = importlib.import_module("micropython")
        pointers = importlib.import_module("pointers")
        path = tmp_path / "functions.py"
        path.write_text(FUNCTIONS)
        names: dict[str, Any] = {}
        exec(compile(FUNCTIONS, str(path), "exec"), names)
        parts = [
            importlib.import_module(f"armtempo_board.stepgen.{name}") for name in ("subdivision", "bezier")
        ]
        yield micropython, pointers.by_index, names, parts


def results(micropython: Any, function: FunctionType, kinds: str, seed: int) -> list[list[int]]:
    """What it returns and leaves in two random arrays."""
    rng = random.Random(seed)
    found = []
    for count in range(1, 12):
        arrays = [array(kind, [rng.randrange(100) for _ in range(40)]) for kind in kinds]
        value = micropython.viper(function)(*arrays, count)
        found.append([value, *arrays[0], *arrays[1]])
    return found


@pytest.mark.parametrize(("name", "kinds"), [("rows", "ii"), ("narrow", "BH")])
def test_with_indices_it_does_the_same(made: Any, name: str, kinds: str) -> None:
    micropython, by_index, names, _ = made
    function = names[name]
    quick = by_index(function)
    assert quick is not function
    assert quick.__code__.co_firstlineno == function.__code__.co_firstlineno
    for seed in range(SEED, SEED + 20):
        assert results(micropython, quick, kinds, seed) == results(micropython, function, kinds, seed), seed


@pytest.mark.parametrize("name", ["by_number", "at_once", "given_on", "within"])
def test_what_it_cannot_or_need_not_change_stays(made: Any, name: str) -> None:
    _, by_index, names, _ = made
    assert by_index(names[name]) is names[name]


def test_a_function_whose_source_is_gone_stays(made: Any, tmp_path: Path) -> None:
    _, by_index, names, _ = made
    (tmp_path / "functions.py").unlink()
    assert by_index(names["rows"]) is names["rows"]


def test_what_takes_most_of_a_start_is_changed(made: Any) -> None:
    _, by_index, _, (subdivision, bezier) = made
    for function in (subdivision.search, bezier.from_control_points, bezier.restrict):
        plain = function.__wrapped__
        assert by_index(plain) is not plain, plain.__name__


def test_a_function_is_changed_once_it_is_called_often(made: Any) -> None:
    micropython, _, names, _ = made
    calls = []

    def counted(function: FunctionType) -> FunctionType:
        calls.append(function)
        return function

    micropython.by_index = counted
    function = micropython.viper(names["rows"])
    values = array("i", range(40))
    for number in range(400):
        assert len(calls) == (number >= micropython._MANY_CALLS)
        function(values, values, 1)
