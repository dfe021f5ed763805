"""Every word of an array that compiled code shares has a name where it is used, and one number behind that name.

``board/make_constants.py`` writes what a compiled module has of others.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from armtempo_shared import limits

from tests import interpreters, sources

BOARD = interpreters.ROOT / "board" / "armtempo_board"
FILES = sorted(BOARD.rglob("*.py"))
make_constants = sources.script(BOARD.parent / "make_constants.py")


def literals(index: ast.AST, allowed: tuple[int, ...] = ()) -> Iterator[int]:
    """Numbers in an index. A neighbour needs no name, one further or one before; nor do a word's 4 bytes."""
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


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(BOARD)))
def test_constants_of_other_modules_are_written(path: Path) -> None:
    assert make_constants.written(path) == path.read_text(), "run 'python board/make_constants.py'"


def test_they_are_found() -> None:
    """In every module of the step generators that names a home, and wherever a line does."""
    lines = [line for path in FILES for line in path.read_text().splitlines() if "as in " in line]
    assert len(lines) > 15
    for line in lines:
        assert not re.search(r"\bas in \w+\.py", line) or make_constants._HOME.search(line), line


def test_ticks_are_those_of_the_limits() -> None:
    assert make_constants.constants(BOARD / "hardware" / "isr.py")["SAMPLE_TICKS"] == str(limits.SAMPLE_TICKS)
    per_us = make_constants.constants(BOARD / "motion" / "engine_parts.py")["TICKS_PER_US"]
    assert int(per_us) * 1_000_000 == limits.TICK_HZ
