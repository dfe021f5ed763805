"""Every word of an array that compiled code shares has a name where it is used, and one number behind that name.

``const`` folds within a file only, so each compiled file has its own ``_NAME = const(n)`` of what it uses of others.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from armtempo_shared import limits

from tests import interpreters

BOARD = interpreters.ROOT / "board" / "armtempo_board"
FILES = sorted(BOARD.rglob("*.py"))


def literals(index: ast.AST, allowed: tuple[int, ...] = ()) -> Iterator[int]:
    """Numbers that stand in an index. A neighbour needs no name, one further or one before; nor do a word's 4 bytes."""
    if isinstance(index, ast.Constant) and isinstance(index.value, int) and index.value not in allowed:
        yield index.value
    if isinstance(index, ast.BinOp) and isinstance(index.op, ast.Add | ast.Sub):
        allowed = (1,)
    elif isinstance(index, ast.BinOp) and isinstance(index.op, ast.Mult):
        allowed = (4,)
    else:
        allowed = ()
    if not isinstance(index, ast.Call | ast.Subscript):  # what they are given is no index of this array
        for part in ast.iter_child_nodes(index):
            yield from literals(part, allowed)


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(BOARD)))
def test_no_index_is_a_number(path: Path) -> None:
    found = [
        f"line {node.lineno}: {ast.unparse(node)}"
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Subscript)
        for _ in literals(node.slice)
    ]
    assert not found


def constants(path: Path) -> dict[str, int]:
    """Numbers that a file names, without the underscore of private names; such as are made of others are left out."""
    found = {}
    for node in ast.parse(path.read_text()).body:
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            value = node.value.args[0] if isinstance(node.value, ast.Call) and node.value.args else node.value
            try:
                number = eval(compile(ast.Expression(value), "<constant>", "eval"), {"__builtins__": {}})
            except (NameError, TypeError):
                continue
            if isinstance(number, int):
                found[node.targets[0].id.lstrip("_")] = number
    return found


def blocks(path: Path) -> Iterator[tuple[Path, str, int]]:
    """(home, name, number) of what a file repeats: it stands below a comment "as in", which names the home."""
    own, home = constants(path), None
    for line in path.read_text().splitlines():
        named = re.match(r"# as in (\w+)\.py", line)
        name = line.split(" = ")[0].lstrip("_")
        if named:
            (home,) = BOARD.rglob(f"{named[1]}.py")
        elif not line or (line.startswith("#") and not line.startswith("# of ")):
            home = None
        elif home and name in own:
            yield home, name, own[name]


NODES = {"FIRST": "FIRST_NODE", "MIDDLE": "MIDDLE_NODE", "END": "END_NODE", "NEXT": "NODE_WORDS"}
"""Words of a node are also named by the node's place in the solver, or behind another node."""


def expected(name: str, words: dict[str, int]) -> int:
    """The number that a name has by the words of its home."""
    if name in words:
        return words[name]
    first, _, rest = name.rpartition("_")
    if first in NODES and f"NODE_{rest}" in words:
        return words[NODES[first]] + words[f"NODE_{rest}"]
    if f"NODE_{name}" in words:
        return words["FIRST_NODE"] + words[f"NODE_{name}"]
    if rest.isdigit() and first in words:  # points count from 0
        return words[first] + int(rest)
    if rest.isdigit() and f"FIRST_{first}" in words:  # differences from 1
        return words[f"FIRST_{first}"] + int(rest) - 1
    if first == "NEXT":  # point
        return words[rest] + 1
    raise AssertionError(f"{name} is no word")


@pytest.mark.parametrize(
    "path", [path for path in FILES if "# as in" in path.read_text()], ids=lambda path: path.stem
)
def test_repeated_words_are_those_of_their_home(path: Path) -> None:
    for home, name, number in blocks(path):
        assert number == expected(name, constants(home)), (home.name, name)


def test_all_files_that_share_arrays_are_held_together() -> None:
    repeats = {path.stem: {home.stem for home, _, _ in blocks(path)} for path in FILES}
    assert {name for name, homes in repeats.items() if homes} == {
        "subdivision", "newton", "cubics", "interval_steps", "time_law", "rate_check", "step_generator",
        "step_queue",
    }  # fmt: skip
    assert repeats["interval_steps"] == {"step_queue", "newton", "subintervals", "bezier", "subdivision"}
    assert sum(len(list(blocks(path))) for path in FILES) > 80


def test_ticks_are_those_of_the_limits() -> None:
    assert constants(BOARD / "hardware" / "isr.py")["SAMPLE_TICKS"] == limits.SAMPLE_TICKS
    assert constants(BOARD / "motion" / "engine_parts.py")["TICKS_PER_US"] * 1_000_000 == limits.TICK_HZ
