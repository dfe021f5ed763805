"""Imports of the board program point one way: no package imports one above it, and no module a user of its own."""

from __future__ import annotations

import ast
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

from tests import interpreters

BOARD = interpreters.ROOT / "board" / "armtempo_board"
BELOW = {
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
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and str(node.module).split(".")[0] == BOARD.name:
            for name in [str(node.module), *(f"{node.module}.{alias.name}" for alias in node.names)]:
                module = name.removeprefix(BOARD.name).removeprefix(".")
                if module in FILES:
                    found.add(module)
    return found


def package(module: str) -> str:
    return module.rpartition(".")[0]


@pytest.mark.parametrize("module", sorted(FILES))
def test_packages_import_those_below(module: str) -> None:
    own = package(module)
    if own == "stepgen":
        names = {
            alias.name if isinstance(node, ast.Import) else str(node.module)
            for node in ast.walk(ast.parse(FILES[module].read_text()))
            if isinstance(node, ast.Import | ast.ImportFrom)
            for alias in node.names
        }
        assert not names & HARDWARE
    if module == "app.program":
        return  # imports the deepest first, to save stack
    assert {package(other) for other in imported(FILES[module])} <= {own, *BELOW[own]}


def test_no_module_imports_its_user() -> None:
    graph = {module: imported(path) for module, path in FILES.items()}
    order = list(TopologicalSorter(graph).static_order())  # CycleError if there is a cycle
    assert len(order) == len(FILES) > 30
    assert order.index("app.controller") < order.index("app.commands") < order.index("app.app")


def test_the_package_itself_imports_nothing_at_once() -> None:
    for path in (BOARD / "__init__.py", *BOARD.glob("*/__init__.py")):
        for node in ast.parse(path.read_text()).body:
            assert not isinstance(node, ast.Import | ast.ImportFrom), path
