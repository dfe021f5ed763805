"""The tests that concern a line: those that execute it, quickest first, then what else may notice a mistake there."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable
from functools import cache
from itertools import zip_longest
from pathlib import Path

from tests.interpreters import ROOT
from tests.mutation.executed import Executed

MOST = 14
"""Test files that are run for a file of the host."""
UNKNOWN_S = 5.0
"""What a test file is taken to need that was not traced."""
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
WORDS = "tests/board/test_words.py::test_repeated_words_are_those_of_their_home"
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
    *[
        f"tests/system/test_{name}.py"
        for name in ("wired_pins", "pulses", "mpremote", "run", "samples", "homing", "postures", "jog")
    ],
]


def tests(path: Path, line: int, executed: Executed, seconds: float) -> list[str]:
    """Tests that take so many seconds together, in the order to run them.

    After those that execute the line come those that execute its function, the others of their files, and those that
    import the module. What runs under MicroPython is not traced: there a case on CPython stands for the same case on
    MicroPython. Where that was not traced either, the tests of files that are listed here by folder come in between.
    """
    by_file: dict[str, list[str]] = {}
    for test in _quickest(executed.seconds, executed):
        by_file.setdefault(test.split("::")[0], []).append(test)
    exact, near = _spans(path, line)
    ordered = [*_executing(exact, executed), *_executing(near, executed)]
    files = [*[test.split("::")[0] for test in ordered], *by_imports(path)]
    if "cli" in path.parts:  # a command is imported when it is called
        files += by_command(path.stem.strip("_"))
    others = _in_turn([by_file.get(file, [file]) for file in dict.fromkeys(files)])
    if not str(path).startswith("host/") or "simulator" in path.parts:
        found = [test for file in by_folder(path) for test in by_file.get(file, [file])]
        listed = _quickest([test for test in found if not _is_traced(test, executed)], executed)
        ordered = _in_turn([ordered, listed])
    ordered += others
    if path.parts[0] == "board":  # they read sources, and execute none of them
        ordered = [*(test for test in executed.seconds if test.startswith(f"{WORDS}[")), *ordered]
    if str(path).startswith("shared/"):  # its own tests take no time
        ordered = [*(test for file in SHARED for test in by_file.get(file, [file])), *ordered]
    chosen: list[str] = []
    total_s = 0.0
    if "cpython" not in path.parts:
        ordered = [_quicker(test, executed) for test in ordered]
    for test in dict.fromkeys(ordered):
        test_s = executed.seconds.get(test, UNKNOWN_S)
        if total_s + test_s <= seconds or not chosen:
            total_s += test_s
            chosen.append(test)
    return chosen


def _in_turn(lists: list[list[str]]) -> list[str]:
    """The first of each, then the second of each, and so on."""
    return [test for each in zip_longest(*lists) for test in each if test is not None]


def _executing(lines: dict[str, set[int]], executed: Executed) -> list[str]:
    """Tests that execute any of the lines, then the others of a file whose fixtures do; quickest first."""
    found = [
        name
        for name, files in executed.lines.items()
        if name and any(wanted & files.get(path, set()) for path, wanted in lines.items())
    ]
    made = tuple(f"{name}::" for name in found if "::" not in name)
    shared = [test for test in executed.seconds if made and test.startswith(made)]
    own = [name for name in found if "::" in name]
    return list(dict.fromkeys([*_quickest(own, executed), *_quickest(shared, executed)]))


def _quickest(names: Iterable[str], executed: Executed) -> list[str]:
    return sorted(names, key=lambda test: executed.seconds.get(_quicker(test, executed), UNKNOWN_S))


def _is_traced(test: str, executed: Executed) -> bool:
    """Whether the lines of the board's side are known: by the same case on CPython, or without a board."""
    twin = re.sub(r"\[micropython\b", "[cpython", test)
    return twin in executed.lines and ("[cpython" in twin or not test.startswith("tests/system/"))


def _quicker(test: str, executed: Executed) -> str:
    """The same case on MicroPython where there is one: it takes less time, and one interpreter is enough."""
    twin = re.sub(r"\[cpython\b", "[micropython", test)
    return twin if twin in executed.seconds else test


@cache
def _spans(path: Path, line: int) -> tuple[dict[str, set[int]], dict[str, set[int]]]:
    """The lines of the statement, and those of the function around it; of a constant, the lines that name it."""
    tree = ast.parse((ROOT / path).read_text(encoding="utf-8"))
    statement, function = _innermost(tree, line)
    first, last = statement.lineno, statement.end_lineno or statement.lineno
    body = getattr(statement, "body", None)
    if body:
        last = max(first, body[0].lineno - 1)
    own = {str(path): set(range(first, last + 1))}
    if function is not None:
        return own, {str(path): set(range(function.body[0].lineno, (function.end_lineno or 0) + 1))}
    names = [node for node in ast.walk(statement) if isinstance(node, ast.Name)]
    targets = [node.id for node in names if isinstance(node.ctx, ast.Store)]
    return _naming(targets), {str(path): _inside_functions(tree)}


def _innermost(tree: ast.Module, line: int) -> tuple[ast.stmt, ast.FunctionDef | None]:
    statement: ast.stmt = tree.body[0]
    function = None
    for node in ast.walk(tree):  # outer ones first
        if isinstance(node, ast.stmt) and node.lineno <= line <= (node.end_lineno or 0):
            statement = node
            if isinstance(node, ast.FunctionDef) and node.body[0].lineno <= line:
                function = node
    return statement, function


def _naming(names: list[str]) -> dict[str, set[int]]:
    """Lines of the sources in which one of the names stands."""
    if not names:
        return {}
    word = re.compile(rf"\b({'|'.join(names)})\b")
    named = {
        path: {number for number, text in enumerate(lines, 1) if word.search(text)}
        for path, lines in _sources().items()
    }
    return {path: lines for path, lines in named.items() if lines}


def _inside_functions(tree: ast.Module) -> set[int]:
    return {
        line
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef)
        for line in range(node.body[0].lineno, (node.end_lineno or 0) + 1)
    }


@cache
def _sources() -> dict[str, list[str]]:
    """Lines of every source file, by its path."""
    return {
        str(path.relative_to(ROOT)): path.read_text(encoding="utf-8").splitlines()
        for folder in ("host/armtempo", "shared/armtempo_shared", "board/armtempo_board")
        for path in sorted((ROOT / folder).rglob("*.py"))
    }


def by_folder(path: Path) -> list[str]:
    """Test files for code that runs under MicroPython."""
    name = str(path)
    if name.startswith("host/armtempo/simulator"):
        return SIMULATED
    if name.startswith("shared/"):
        return [*SHARED, *(f"tests/board/test_{name}.py" for name in ("check", "app", "engine"))]
    found = [f"tests/board/{test}.py" for test in BY_FOLDER[str(path.parent)]]
    if path.parent.name in ("app", "link", "storage"):
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
    word = f'"{name.replace("_", "-").removesuffix("-screen")}"'
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
