"""A user's program for the board (``cell``): read, checked against an arm, and marked with its lines.

The board has no way to ask where a program is. So its source gets marks before it is sent: in each call of the cell and
in the head of each loop and comprehension, by which the board also does its own work in one that calls nothing. Lines
stay as they are.
"""

from __future__ import annotations

import ast
import inspect
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from armtempo_board.app.cell import NO_LINE, Cell
from armtempo_shared.program import EACH, FREE, MARK, STILL
from armtempo_shared.sequence import MAX_COUNTERS

from armtempo.basics import number_table
from armtempo.basics.errors import InputError
from armtempo.basics.kinds import is_number
from armtempo.basics.text import did_you_mean
from armtempo.model import home_switches, program_calls
from armtempo.model.arm import Arm
from armtempo.model.job import NAME_RULE, is_name
from armtempo.model.parts import NOTHING

_PACKAGE, _CELL = "armtempo_board", "cell"
_CALLS = {name: value for name, value in vars(Cell).items() if not name.startswith("_")}
INTERNAL = ("at", "each", "still", "free", "opened", "close_files")
"""Those of them that a program does not call itself."""
_LEAST_BEYOND_STEPS = 1.0
"""The board rounds to whole steps: what is less beyond a range may be its end."""


@dataclass(frozen=True)
class UserProgram:
    """A program; ``postures``, ``motions`` and so on: those that it names in its text, with the first line."""

    name: str
    """Name on the board."""
    path: Path
    source: str
    marked: str
    postures: dict[str, int]
    motions: dict[str, int]
    counters: dict[str, int]
    pallets: dict[str, int]
    tools: dict[str, int]
    homes: int = 0
    """The line in which it homes the arm; 0: it does not."""
    takes: bool = False
    """Whether it takes pins or timers that are not in its text."""

    @property
    def file(self) -> str:
        """Name of its file, as tracebacks show it."""
        return self.path.name

    def motion_file(self, name: str) -> Path:
        """Where the plan of a motion that it names is, if not on the board."""
        return self.path.parent / f"{name}.json"

    @classmethod
    def load(cls, path: Path | str, arm: Arm) -> UserProgram:
        """The program of a file, for this arm.

        Raises InputError, with file and line, for wrong syntax, a call that the cell does not have, or a name that the
        arm does not have.
        """
        path = Path(path)
        if not is_name(path.stem):
            raise InputError(f"{path}: its name is not valid on the board", f"give {NAME_RULE}, and .py")
        source = number_table.text_of(path)
        try:
            tree = ast.parse(source)
        except (SyntaxError, ValueError) as error:
            line = getattr(error, "lineno", None) or 1
            problem = getattr(error, "msg", str(error))
            raise InputError(f"{path}, line {line}: {problem}", "correct the line") from None
        except RecursionError:
            raise _too_deep(path) from None
        reader = _Reader(path, arm, _cell_name(tree, path))
        reader.read(tree)
        try:
            marks = _Marks(source, reader.cell)
            marked = marks.marked(tree)
        except RecursionError:
            raise _too_deep(path) from None
        named = reader.postures, reader.motions, reader.counters, reader.pallets, reader.tools
        return cls(path.stem, path, source, marked, *named, reader.homes, marks.takes)


def _too_deep(path: Path) -> InputError:
    return InputError(f"{path}: an expression or block is nested too deep", "split it into several lines")


def _cell_name(tree: ast.Module, path: Path) -> str:
    """The name under which the program imports the cell."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module == _PACKAGE:
            for alias in node.names:
                if alias.name == _CELL:
                    return alias.asname or alias.name
    raise InputError(f"{path} does not import the cell", f"write: from {_PACKAGE} import {_CELL}")


@dataclass
class _Reader:
    """Checks the calls of a program."""

    path: Path
    arm: Arm
    cell: str
    postures: dict[str, int] = field(default_factory=dict)
    motions: dict[str, int] = field(default_factory=dict)
    counters: dict[str, int] = field(default_factory=dict)
    pallets: dict[str, int] = field(default_factory=dict)
    tools: dict[str, int] = field(default_factory=dict)
    homes: int = 0

    def read(self, tree: ast.Module) -> None:
        """Check all calls."""
        for node in ast.walk(tree):
            if isinstance(node, ast.Attribute) and _is_name(node.value, self.cell):
                self._known(node)
            if isinstance(node, ast.Import | ast.ImportFrom):
                self._check_import(node)
            if (
                isinstance(node, ast.Call)
                and isinstance(node.func, ast.Attribute)
                and _is_name(node.func.value, self.cell)
            ):
                self._known(node.func)
                self._check(node, node.func.attr)
        for found in program_calls.problems(tree, self.arm, self.cell):
            raise InputError(f"{self.path}, line {found.line}: {found.what}", found.next_step)
        if len(self.counters) > MAX_COUNTERS:
            raise InputError(f"{self.path}: {len(self.counters)} counters", f"use at most {MAX_COUNTERS}")

    def _place(self, node: ast.AST) -> str:
        return f"{self.path}, line {getattr(node, 'lineno', 1)}: "

    def _known(self, node: ast.Attribute) -> None:
        if node.attr not in _CALLS or node.attr in INTERNAL:
            names = [name for name in _CALLS if name not in INTERNAL]
            raise InputError(
                f"{self._place(node)}the cell has no {node.attr!r}{did_you_mean(node.attr, names)}",
                f"it has {', '.join(names)}",
            )

    def _check(self, node: ast.Call, name: str) -> None:
        given = self._arguments(node, name)
        if name == "home":
            try:
                home_switches.check_board_can_home(self.arm)
            except InputError as error:
                raise InputError(f"{self._place(node)}{error.problem}", error.hint) from None
            self.homes = self.homes or node.lineno
        first = next(iter(given.values()), None)
        if name == "goto":
            line = given.get("line")
            if isinstance(line, ast.Constant) and line.value:
                raise InputError(f"{self._place(node)}{NO_LINE}", "see 'armtempo plan', line = true in a job")
            if isinstance(first, ast.Tuple | ast.List):
                self._check_posture(first)
        if not isinstance(first, ast.Constant) or not isinstance(first.value, str):
            return
        text = first.value
        try:
            if name == "goto":
                self.arm.posture(text)
                self.postures.setdefault(text, node.lineno)
            elif name in ("run", "start"):
                self.motions.setdefault(_valid(text), node.lineno)
            elif name == "count":
                self.counters.setdefault(_valid(text), node.lineno)
            elif name == "pallet":
                self.arm.pallet(text)
                self.pallets.setdefault(text, node.lineno)
            elif name == "tool":
                if not text:
                    raise InputError("the name of the tool is empty", f"give one, or {NOTHING!r} for none")
                if self.arm.with_tool(text).tool:
                    self.tools.setdefault(text, node.lineno)
            elif name in ("wait", "active"):
                self.arm.input(text)
            elif name == "set":
                self._check_output(text, given.get("value"))
        except InputError as error:
            raise InputError(f"{self._place(node)}{error.problem}", error.hint) from None

    def _check_posture(self, node: ast.Tuple | ast.List) -> None:
        """Of numbers that are in the text; others the board checks."""
        try:
            angles = ast.literal_eval(node)
        except ValueError:
            return
        joints = self.arm.driven
        if len(angles) != len(joints) or not all(is_number(angle) for angle in angles):
            raise InputError(
                f"{self._place(node)}{ast.unparse(node)} is no posture",
                f"it has a number for each of {', '.join(joint.name for joint in joints)}",
            )
        for joint, angle in zip(joints, angles, strict=True):
            low, high = joint.range_deg
            if not low <= joint.placed(angle, _LEAST_BEYOND_STEPS) <= high:
                raise InputError(
                    f"{self._place(node)}{joint.name} at {angle:g} {joint.unit.word} is outside of its range {low:g} "
                    f"to {high:g}",
                    "stay within it",
                )

    def _check_output(self, name: str, value: ast.expr | None) -> None:
        output = self.arm.outputs[self.arm.output(name)]
        if isinstance(value, ast.Constant) and isinstance(value.value, str | int | float):
            output.raw(value.value)

    def _arguments(self, node: ast.Call, name: str) -> dict[str, ast.expr]:
        """The arguments of a call by the names of parameters; empty if stars hide them."""
        if name == "Error" or any(isinstance(one, ast.Starred) for one in node.args):
            return {}
        if any(one.arg is None for one in node.keywords):
            return {}
        named = {str(one.arg): one.value for one in node.keywords}
        try:
            bound = inspect.signature(_CALLS[name]).bind(None, *node.args, **named)
        except TypeError as error:
            raise InputError(
                f"{self._place(node)}{self.cell}.{name}: {error}",
                f"its arguments are {_parameters(name)}",
            ) from None
        found: dict[str, Any] = dict(bound.arguments)
        found.pop("self")
        return found

    def _check_import(self, node: ast.Import | ast.ImportFrom) -> None:
        """The board gets this file alone."""
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else [node.module or ""]
        for name in names:
            if (self.path.parent / f"{name.partition('.')[0]}.py").is_file():
                raise InputError(
                    f"{self._place(node)}the board gets this file alone, not {name}.py beside it",
                    f"write what it needs of {name}.py into this file",
                )


def _valid(name: str) -> str:
    if not is_name(name):
        raise InputError(f"{name!r} is not a valid name on the board", f"give {NAME_RULE}")
    return name


def _parameters(name: str) -> str:
    parameters = list(inspect.signature(_CALLS[name]).parameters.values())[1:]
    return ", ".join(str(one).replace("'", "") for one in parameters) or "none"


def _is_name(node: ast.expr, name: str) -> bool:
    return isinstance(node, ast.Name) and node.id == name


class _Marks:
    """Puts marks into a source."""

    def __init__(self, source: str, cell: str) -> None:
        self._lines = source.encode().splitlines(keepends=True)
        self._cell = cell
        self._texts: list[tuple[int, int, int, bytes]] = []  # line, byte, order, text
        self._names: dict[str, str] = {}
        self.takes = False  # whether it takes pins or timers that are not in its text

    def marked(self, tree: ast.Module) -> str:
        """The source with its marks."""
        self._names = program_calls.imported(tree)
        for node in _visible(tree):
            if isinstance(node, ast.Call):
                self._mark_call(node)
            elif isinstance(node, ast.While):
                self._around(node.test, f"{MARK}({node.lineno}) and (", ")")
            elif isinstance(node, ast.For) or (isinstance(node, ast.comprehension) and not node.is_async):
                self._around(node.iter, f"{EACH}({node.iter.lineno}, (", "))")
        for line, at, _, text in sorted(self._texts, reverse=True):
            row = self._lines[line - 1]
            self._lines[line - 1] = row[:at] + text + row[at:]
        return b"".join(self._lines).decode()

    def _mark_call(self, node: ast.Call) -> None:
        """A call of the cell, or one that writes to the flash, or takes a pin or timer that is not in the text."""
        if isinstance(node.func, ast.Attribute) and _is_name(node.func.value, self._cell):
            self._around(node.func.value, f"{MARK}({node.lineno}, ", ")")
        called = program_calls.dotted(node.func, self._names)
        if called in program_calls.FLASH:
            base = node.func.value if isinstance(node.func, ast.Attribute) else node.func
            self._around(base, f'{STILL}({node.lineno}, "{called}", ', ")")
        elif program_calls.takes(called) and node.args and not self._is_plain(node.args[0]):
            self.takes = True
            self._around(node.args[0], f"{FREE}({node.lineno}, ", ")")

    def _is_plain(self, node: ast.expr) -> bool:
        """Whether an argument is seen in the text, as "PA15" or Pin.cpu.A15, or is none that can be marked."""
        return isinstance(node, ast.Constant | ast.Starred) or bool(program_calls.dotted(node, self._names))

    def _around(self, node: ast.expr, before: str, after: str) -> None:
        """Put texts around a node; the marks of an outer one, which is visited first, go around those of an inner."""
        order = len(self._texts) + 1
        end = node.end_lineno or 0, node.end_col_offset or 0  # None in trees that no parser made
        self._texts.append((node.lineno, node.col_offset, order, before.encode()))
        self._texts.append((*end, -order, after.encode()))


def _visible(tree: ast.AST) -> Iterator[ast.AST]:
    """All nodes, outer ones first, but what is in f-strings: Python 3.11 does not say where that is."""
    yield tree
    for child in ast.iter_child_nodes(tree):
        if not isinstance(child, ast.JoinedStr):
            yield from _visible(child)
