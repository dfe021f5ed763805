"""The tests that concern a source file, quickest and nearest first."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

from tests.interpreters import ROOT

WITHOUT = "not micropython-arm and not cut_off and not demo and not examples and not wheel"
WITHOUT_CPYTHON = f"{WITHOUT} and not cpython"
"""For code that runs on MicroPython: one interpreter is enough to notice."""
MOST = 14
"""Test files that are run for a file of the host."""
BY_FOLDER = {
    "board/armtempo_board/stepgen": [
        "test_check",
        "test_walker",
        "test_parts",
        "test_engine",
        "test_cortex_m4",
    ],
    "board/armtempo_board/motion": ["test_check", "test_engine", "test_walker", "test_app"],
    "board/armtempo_board/hardware": ["test_registers", "test_engine", "test_interrupt_cost"],
    "board/armtempo_board/storage": ["test_store", "test_app"],
    "board/armtempo_board/link": ["test_app"],
    "board/armtempo_board/app": ["test_app", "test_replay"],
    "board/armtempo_board": ["test_app", "test_replay", "test_engine"],
}
WHOLE = ["tests/system/test_whole_board.py"]
IN_PROCESS = [
    f"tests/host/test_{name}.py" for name in ("greeting", "link", "link_again", "refusal", "link_noise")
]
SHARED = [f"tests/shared/{path.name}" for path in sorted((ROOT / "tests" / "shared").glob("test_*.py"))]
SIMULATED = [
    "tests/system/test_virtual_hardware.py",
    "tests/system/test_virtual_arm.py",
    "tests/board/test_engine.py",
    "tests/system/test_virtual_repl.py",
    "tests/system/test_virtual_board.py",
    "tests/system/test_virtual_start.py",
    "tests/system/test_virtual_faults.py",
    "tests/board/test_power_cut.py",
    *WHOLE,
]


def tests(path: Path) -> list[str]:
    """Paths of test files, relative to the checkout."""
    name = str(path)
    if name.startswith("host/armtempo/simulator"):
        return SIMULATED
    if name.startswith("host/armtempo/cli/"):  # the command is imported when it is called
        return list(dict.fromkeys([*by_imports(path), *by_command(path.stem.strip("_"))]))
    if name.startswith("host/"):
        return by_imports(path)
    if name.startswith("shared/"):
        nearest = [test for test in by_imports(path) if test not in SHARED][: MOST - len(SHARED)]
        return [*SHARED, *nearest, "tests/board/test_check.py", "tests/board/test_app.py"]
    folder = str(path.parent)
    found = [f"tests/board/{test}.py" for test in BY_FOLDER[folder]]
    if folder.split("/")[-1] in ("app", "link", "storage"):
        found += [*IN_PROCESS, "tests/board/test_fuzz.py"]
    return found + WHOLE


def by_imports(path: Path) -> list[str]:
    """Test files whose imports lead to the module, those first that need the fewest steps."""
    target = _module(path)
    distance = {target: 0}
    users = _users()
    reached = [target]
    for module in reached:
        for user in users.get(module, ()):
            if user not in distance:
                distance[user] = distance[module] + 1
                reached.append(user)
    found = [
        module
        for module in reached
        if module.split(".")[-1].startswith("test_") and ".benchmark" not in module
    ]
    found.sort(key=lambda module: (distance[module], "system" in module))
    return [module.replace(".", "/") + ".py" for module in found[:MOST]]


def by_command(name: str) -> list[str]:
    """Test files in which the command's name stands in quotes."""
    found = sorted(ROOT.glob("tests/host/**/test_*.py")) + sorted(ROOT.glob("tests/system/test_*.py"))
    word = f'"{name.replace("_", "-")}"'
    return [str(path.relative_to(ROOT)) for path in found if word in path.read_text(encoding="utf-8")][:MOST]


def _module(path: Path) -> str:
    parts = path.with_suffix("").parts
    parts = parts[1:] if parts[0] in ("host", "shared", "board") else parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@cache
def _users() -> dict[str, list[str]]:
    """By module: the modules that import it."""
    sources = {
        _module(path.relative_to(ROOT)): path
        for folder in ("host/armtempo", "shared", "board", "tests")
        for path in sorted((ROOT / folder).rglob("*.py"))
    }
    found: dict[str, list[str]] = {}
    for module, path in sources.items():
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = []
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom) and node.module:
                names = [f"{node.module}.{alias.name}" for alias in node.names] + [node.module]
            for name in names:
                if name in sources and name != module:
                    found.setdefault(name, []).append(module)
    return found
