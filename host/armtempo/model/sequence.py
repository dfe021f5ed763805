"""A sequence of motions, outputs and waits before planning, and its file."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any

from armtempo_shared.sequence import MAX_NESTING, MAX_REPEATS

from armtempo.basics import toml_table
from armtempo.basics.arguments import checked, checked_fields
from armtempo.basics.errors import InputError
from armtempo.basics.text import did_you_mean
from armtempo.basics.toml_table import Table
from armtempo.model import tool_segment
from armtempo.model.arm import Arm
from armtempo.model.job import Job, held, is_name, name_of, read_angles, tool_named
from armtempo.model.pallet import ArmPallet
from armtempo.model.plan import Plan
from armtempo.model.posture import ArmPosture
from armtempo.model.steps import (
    FOR_EVER,
    MOST_S,
    ON_TIMEOUT,
    STOP,
    Count,
    EachPlace,
    Goto,
    Hold,
    Repeat,
    RunMotion,
    SetOutput,
    SourceMotion,
    Step,
    ToPlace,
    UseTool,
    Wait,
    WaitInput,
)

LONGEST_NAME = 20
"""Longest name of a sequence: its motions NAME-1, NAME-2, … must fit the board's 24 characters."""
HOME = "home"
_KINDS = (
    "goto", "run", "place", "leave", "output", "holds", "tool", "wait_s", "wait_input", "count", "repeat", "end", "call"
)  # fmt: skip
_OF_PALLETS = ("first_place", "last_place", "reverse")
"""Keys of a repeat for each place of a pallet."""


def is_sequence(path: Path | str) -> bool:
    """Whether a TOML file describes a sequence: it has steps. Raises InputError if it is not TOML."""
    return Path(path).suffix == ".toml" and toml_table.read(path).has("step")


@checked
@checked_fields
@dataclass(frozen=True)
class Sequence:
    """The steps of a sequence."""

    name: str
    steps: tuple[Step, ...]
    start: ArmPosture | None = None
    """Start posture; None: the target of its first motion."""
    source: str = ""
    tool: str = ""
    """The tool of the arm that is on it at first; "": the arm's as it is."""

    def __post_init__(self) -> None:
        """Raise InputError for a name that is invalid on the board."""
        object.__setattr__(self, "steps", _numbered(self.steps, count(1)))
        if not is_name(self.name, LONGEST_NAME):
            raise InputError(
                f"sequence {self.name!r}: not a valid name on the board",
                f"give at most {LONGEST_NAME} of the characters a-z A-Z 0-9 - _",
            )

    @classmethod
    def of(cls, sequence: Sequence | Path | str, arm: Arm) -> Sequence:
        """The sequence itself, or the sequence of a file as in ``load``."""
        return sequence if isinstance(sequence, Sequence) else cls.load(sequence, arm)

    @classmethod
    def load(cls, path: Path | str, arm: Arm | Path | str) -> Sequence:
        """The sequence described by a TOML file, for this arm.

        Raises InputError, naming file, step and key, for anything missing, unknown or not allowed.
        """
        return cls.of_table(toml_table.read(path), Arm.of(arm))

    @classmethod
    def of_table(cls, top: Table, arm: Arm) -> Sequence:
        """The sequence of a table, whose file need not exist yet; raises as ``load``."""
        name = name_of(top, LONGEST_NAME)
        reader = _Reader(arm, Path(top.file), _postures(top, arm))
        start = reader.posture(top, "start") if top.has("start") else None
        steps = reader.steps(top)
        tool = tool_named(top, arm)
        top.done()
        return cls(name, steps, start, top.file, tool)


def _numbered(steps: Iterable[Step], numbers: Iterator[int]) -> tuple[Step, ...]:
    """The steps with numbers as in a file, where those made in code have none; the end of a repeat counts too."""
    found: list[Step] = []
    for step in steps:
        number = next(numbers)
        if isinstance(step, Repeat | EachPlace):
            step = replace(step, steps=_numbered(step.steps, numbers))
            next(numbers)
        found.append(step if step.step else replace(step, step=number))
    return tuple(found)


def arm_named(path: Path | str) -> Path | None:
    """The arm file that a sequence file names; None if it names none."""
    top = toml_table.read(path)
    if not top.has("arm"):
        return None
    named = Path(top.text("arm"))
    beside = Path(path).parent / named
    return beside if beside.is_file() else named


def _postures(top: Table, arm: Arm) -> dict[str, ArmPosture]:
    """The postures of the arm, its home, and the sequence's own, by name."""
    found = {HOME: ArmPosture(HOME, tuple(float(angle) for angle in arm.home_deg))}
    found.update((posture.name, posture) for posture in arm.postures)
    own = top.table("posture")
    if own is None:
        return found
    for name in own.names():
        if name in found:
            raise InputError(f"{top.file}: posture.{name} already exists", "choose another name")
        found[name] = arm.read_posture(own, name)
    return found


@dataclass
class _Reader:
    """Reads the steps of a file, and of the files that it calls."""

    arm: Arm
    file: Path
    postures: dict[str, ArmPosture]
    callers: tuple[Path, ...] = ()
    number: int = 0
    """In a called file: the number of the calling step, for all its steps; 0: each step has its own."""
    motions: dict[Path, SourceMotion] = field(default_factory=dict)

    def steps(self, top: Table) -> tuple[Step, ...]:
        """All steps of a file; a repeat holds its inner steps."""
        top.known("name", "arm", "start", "posture")
        tables = top.tables("step")
        found: list[list[Step]] = [[]]
        begun: list[tuple[Table, int, Callable[..., Step]]] = []
        for index, table in enumerate(tables, 1):
            step = self.number or index
            kind = self._kind(table, index)
            if kind == "repeat":
                begun.append((table, step, self._repeat(table)))
                found.append([])
                if len(begun) > MAX_NESTING:
                    raise table.fail("repeat", f"at most {MAX_NESTING} within each other")
            elif kind == "end":
                table.choice("end", ("repeat",))
                if not begun:
                    raise table.misplaced("end", "write it after a step with repeat")
                row, number, repeat = begun.pop()
                inner = tuple(found.pop())
                found[-1].append(repeat(inner, where=_place(row), step=number))
            else:
                found[-1].extend(_GETTERS[kind](self, table, step))
            table.done()
        if begun:
            raise InputError(
                f"{_place(begun[-1][0])}: repeat without an end",
                'write a step with end = "repeat" after its last step',
            )
        return tuple(found[0])

    def _kind(self, table: Table, index: int) -> str:
        table.known(*_KINDS, "to", "active", "timeout_s", "on_timeout", *_OF_PALLETS)
        kinds = [key for key in _KINDS if table.has(key)]
        if kinds[:1] == ["output"] and set(kinds) <= {"output", "holds", "wait_s"}:
            return "output"
        if len(kinds) == 1:
            return kinds[0]
        table.done()  # an unknown key is the more likely mistake
        what = " and ".join(kinds) if kinds else "nothing"
        raise InputError(f"{_place(table)}: says {what}", f"give one of {', '.join(_KINDS)} in each step")

    def _repeat(self, table: Table) -> Callable[..., Step]:
        """The repeat that begins in a step, without its inner steps."""
        only(table, "repeat", *_OF_PALLETS)
        times = table.peek("repeat")
        if isinstance(times, str) and times != FOR_EVER:
            pallet = self._pallet(table, "repeat", f'"{FOR_EVER}", a whole number, or the name of a pallet')
            last = table.integer("last_place", pallet.places, least=1, most=pallet.places)
            first = table.integer("first_place", 1, least=1, most=last)
            reverse = table.boolean("reverse", False)
            return partial(EachPlace, pallet=pallet.name, first=first, last=last, reverse=reverse)
        only(table, "repeat")
        if times == FOR_EVER:
            table.text("repeat")
            return partial(Repeat, times=0)
        return partial(Repeat, times=table.integer("repeat", least=1, most=MAX_REPEATS))

    def _pallet(self, table: Table, key: str, allowed: str = "the name of a pallet") -> ArmPallet:
        name = table.text(key)
        try:
            return self.arm.pallet(name)
        except InputError as error:
            raise InputError(
                f"{table.file}: {table.place}{key} = {name!r}: {error.problem}",
                f"give {allowed}; {error.hint}",
            ) from None

    def place(self, table: Table, step: int) -> list[Step]:
        kind = "leave" if table.has("leave") else "place"
        only(table, kind)
        name = self._pallet(table, kind).name
        speed = tool_segment.limit(table, "speed_mm_s")
        return [ToPlace(name, leave=kind == "leave", speed_mm_s=speed, where=_place(table), step=step)]

    def goto(self, table: Table, step: int) -> list[Step]:
        only(table, "goto")
        target: ArmPosture | SourceMotion
        if table.has("goto") and str(table.peek("goto")).endswith((".toml", ".json")):
            target = self._motion(table, "goto")
        else:
            target = self.posture(table, "goto")
        line = table.boolean("line", False)
        if table.has("speed_mm_s") and not line:
            raise table.misplaced("speed_mm_s", "leave it out, or give line = true too")
        speed = tool_segment.limit(table, "speed_mm_s")
        return [Goto(target, line=line, speed_mm_s=speed, where=_place(table), step=step)]

    def posture(self, table: Table, key: str) -> ArmPosture:
        """A posture given by name or as angles."""
        if not isinstance(table.peek(key), str):
            angles = read_angles(table, key, self.arm)
            return ArmPosture(self.arm.texts.listed(f"{angle:g}" for angle in angles), angles)
        name = table.text(key)
        if name not in self.postures:
            near = did_you_mean(name, self.postures)
            raise InputError(
                f"{_place(table)}{key} = {name!r}: no such posture{near}",
                f"known here: {', '.join(sorted(self.postures))}; more with [posture.NAME] "
                f"{self.arm.texts.list_key('angles_deg')} = [...]",
            )
        return self.postures[name]

    def run(self, table: Table, step: int) -> list[Step]:
        only(table, "run")
        return [RunMotion(self._motion(table, "run"), where=_place(table), step=step)]

    def _motion(self, table: Table, key: str) -> SourceMotion:
        path = self.file.parent / table.text(key)
        if path not in self.motions:
            source = Plan.load_motion(path) if path.suffix == ".json" else Job.load(path, self.arm)
            self.motions[path] = SourceMotion(path.stem, source)
        return self.motions[path]

    def output(self, table: Table, step: int) -> list[Step]:
        only(table, "output", "to", "wait_s", "holds")
        name, place = table.text("output"), _place(table)
        _placed(place, self.arm.output, name)
        to = table.peek("to")
        if isinstance(to, bool) or not isinstance(to, str | int | float):
            raise table.fail("to", "a state of the output, or a number in its unit")
        _placed(f"{place}to: ", self.arm.outputs[self.arm.output(name)].raw, to)
        table.known("to")
        found: list[Step] = [SetOutput(name, to, where=place, step=step)]
        found += self.holds(table, step) if table.has("holds") else []
        return found + (self.wait(table, step) if table.has("wait_s") else [])

    def holds(self, table: Table, step: int) -> list[Step]:
        only(table, "holds", "output", "to", "wait_s")
        return [Hold(held(table, self.arm), where=_place(table), step=step)]

    def tool(self, table: Table, step: int) -> list[Step]:
        only(table, "tool")
        return [UseTool(tool_named(table, self.arm), where=_place(table), step=step)]

    def wait(self, table: Table, step: int) -> list[Step]:
        only(table, "output", "to", "wait_s", "holds")
        return [Wait(table.number("wait_s", least=0.001, most=MOST_S), where=_place(table), step=step)]

    def wait_input(self, table: Table, step: int) -> list[Step]:
        only(table, "wait_input", "active", "timeout_s", "on_timeout")
        name, place = table.text("wait_input"), _place(table)
        _placed(place, self.arm.input, name)
        active = table.boolean("active", True)
        timeout_s = (
            table.number("timeout_s", 0.0, least=0.001, most=MOST_S) if table.has("timeout_s") else 0.0
        )
        if table.has("on_timeout") and not timeout_s:
            raise table.misplaced("on_timeout", "leave it out, or give timeout_s too")
        then = table.choice("on_timeout", ON_TIMEOUT, STOP)
        return [WaitInput(name, active, timeout_s, then, where=place, step=step)]

    def count(self, table: Table, step: int) -> list[Step]:
        only(table, "count")
        return [Count(name_of(table, key="count"), where=_place(table), step=step)]

    def call(self, table: Table, step: int) -> list[Step]:
        only(table, "call")
        path = (self.file.parent / table.text("call")).resolve()
        chain = (*self.callers, self.file.resolve())
        if path in chain:
            names = " calls ".join(one.name for one in (*chain[chain.index(path) :], path))
            raise InputError(
                f"{_place(table)}call: the sequence calls itself: {names}", "remove one of the calls"
            )
        top = toml_table.read(path)
        if not top.has("step"):
            raise InputError(
                f"{_place(table)}call: {path.name} is not a sequence: it has no [[step]]", "use run for a job"
            )
        postures = {**self.postures, **_postures(top, self.arm)}
        called = _Reader(self.arm, path, postures, chain, step, self.motions)
        steps = called.steps(top)
        top.done()
        return list(steps)


_Getter = Callable[[_Reader, Table, int], list[Step]]
_GETTERS: dict[str, _Getter] = {
    "goto": _Reader.goto,
    "run": _Reader.run,
    "place": _Reader.place,
    "leave": _Reader.place,
    "output": _Reader.output,
    "holds": _Reader.holds,
    "tool": _Reader.tool,
    "wait_s": _Reader.wait,
    "wait_input": _Reader.wait_input,
    "count": _Reader.count,
    "call": _Reader.call,
}


def only(table: Table, *keys: str) -> None:
    """Raise InputError for a key of another kind of step."""
    for key in (*_KINDS, "to", "active", "timeout_s", "on_timeout", *_OF_PALLETS):
        if table.has(key) and key not in keys:
            raise table.misplaced(key, f"leave it out beside {keys[0]}")


def _place(table: Table) -> str:
    return f"{table.file}: {table.place}"


def _placed(place: str, function: Callable[[Any], int], value: Any) -> int:
    """Apply a function of the arm to a value; an InputError names the step."""
    try:
        return function(value)
    except InputError as error:
        raise InputError(f"{place}{error.problem}", error.hint) from None
