"""The shape of the board program: who imports whom, and a name for every word of the arrays."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

from armtempo_shared import limits

from tests import interpreters, sources

BOARD = interpreters.ROOT / "board" / "armtempo_board"
BELOW = {
    "selftest": {"app", "storage", "motion", "stepgen", "hardware", ""},
    "app": {"link", "storage", "motion", "hardware", ""},
    "link": {""},
    "storage": {""},
    "motion": {"stepgen", "hardware", ""},
    "stepgen": {""},
    "hardware": {""},
    "": set(),
}
"""What the modules of a package may import besides each other; "": errors, buffers, memory, heap."""
TOP = ("__init__", "boot", "main")
HARDWARE = {"machine", "pyb", "stm", "uctypes", "os", "time"}

FILES = {
    ".".join(path.relative_to(BOARD).with_suffix("").parts): path
    for path in BOARD.rglob("*.py")
    if path.stem != "__init__" and path.stem not in TOP
}


def imported(path: Path) -> set[str]:
    """Modules of the board package that a file imports, anywhere in it."""
    found = set()
    for node in sources.nodes(path):
        if isinstance(node, ast.ImportFrom) and str(node.module).split(".")[0] == BOARD.name:
            for name in [str(node.module), *(f"{node.module}.{alias.name}" for alias in node.names)]:
                module = name.removeprefix(BOARD.name).removeprefix(".")
                if module in FILES:
                    found.add(module)
    return found


def package(module: str) -> str:
    return module.rpartition(".")[0]


def test_packages_import_those_below() -> None:
    for module in sorted(FILES):
        own = package(module)
        if own == "stepgen":
            names = {
                alias.name if isinstance(node, ast.Import) else str(node.module)
                for node in sources.nodes(FILES[module])
                if isinstance(node, ast.Import | ast.ImportFrom)
                for alias in node.names
            }
            assert not names & HARDWARE, module
        if module == "app.program":
            continue  # imports the deepest first, to save stack
        assert {package(other) for other in imported(FILES[module])} <= {own, *BELOW[own]}, module


def test_no_module_imports_its_user() -> None:
    graph = {module: imported(path) for module, path in FILES.items()}
    order = list(TopologicalSorter(graph).static_order())  # CycleError if there is a cycle
    assert len(order) == len(FILES) > 30
    assert order.index("app.controller") < order.index("app.commands") < order.index("app.app")


def test_the_package_itself_imports_nothing_at_once() -> None:
    for path in (BOARD / "__init__.py", *BOARD.glob("*/__init__.py")):
        for node in sources.tree(path).body:
            assert not isinstance(node, ast.Import | ast.ImportFrom), path


# every word of an array that compiled code shares has a name where it is used, and one number behind that name


PATHS = sorted(BOARD.rglob("*.py"))
make_constants = sources.script(BOARD.parent / "make_constants.py")


def literals(index: ast.AST, allowed: tuple[int, ...] = ()) -> Iterator[int]:
    """Numbers in an index. The first needs no name, nor a neighbour, one further or before, nor a word's 4 bytes."""
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


def test_no_index_is_a_number() -> None:
    for path in PATHS:
        found = [
            f"line {node.lineno}: {ast.unparse(node)}"
            for node in sources.nodes(path)
            if isinstance(node, ast.Subscript)
            for _ in literals(node.slice, (0,))
        ]
        assert not found, path


def test_constants_of_other_modules_are_written() -> None:
    for path in PATHS:
        assert make_constants.written(path) == path.read_text(), (
            f"{path}: run 'python board/make_constants.py'"
        )


def test_they_are_found() -> None:
    """In every module of the step generators that names a home, and wherever a line does."""
    lines = [line for path in PATHS for line in path.read_text().splitlines() if "as in " in line]
    assert len(lines) > 15
    for line in lines:
        assert not re.search(r"\bas in \w+\.py", line) or make_constants._HOME.search(line), line


def test_ticks_are_those_of_the_limits() -> None:
    assert make_constants.constants(BOARD / "hardware" / "isr.py")["SAMPLE_TICKS"] == str(limits.SAMPLE_TICKS)
    per_us = make_constants.constants(BOARD / "motion" / "engine_parts.py")["TICKS_PER_US"]
    assert int(per_us) * 1_000_000 == limits.TICK_HZ
