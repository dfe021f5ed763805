"""The sequence that the panel edits: its steps, with their comments, and its plan."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from armtempo.basics import toml_table
from armtempo.basics.errors import InputError
from armtempo.model.arm import Arm
from armtempo.model.parts import NOTHING
from armtempo.model.plan import Plan
from armtempo.model.sequence import Sequence, is_sequence
from armtempo.model.steps import ON_TIMEOUT
from armtempo.panel.file_editor import FileEditor, put, text_of
from armtempo.panel.toml_blocks import TomlBlocks

KINDS: dict[str, tuple[str, ...]] = {
    "goto": (),
    "run": (),
    "output": ("to", "holds", "wait_s"),
    "holds": (),
    "tool": (),
    "wait_s": (),
    "wait_input": ("active", "timeout_s", "on_timeout"),
    "count": (),
    "repeat": ("first_place", "last_place", "reverse"),
    "place": ("speed_mm_s",),
    "leave": ("speed_mm_s",),
    "end": (),
    "call": (),
}
"""Kinds of steps, with their further keys."""
_FIRST = {
    "goto": "home",
    "holds": NOTHING,
    "tool": NOTHING,
    "wait_s": "1",
    "repeat": "for ever",
    "end": "repeat",
}
_STEP = "step"


class SequenceEditor(FileEditor):
    """The steps of a file."""

    kind = "sequence"

    def __init__(self, arm: Arm, folder: Path) -> None:
        super().__init__(arm, folder)
        self._plan: tuple[int, Plan | None] = (-1, None)

    def take_arm(self, arm: Arm) -> None:
        """Take another version of the arm, for which it is planned anew."""
        super().take_arm(arm)
        self._plan = -1, None

    def new_text(self, name: str) -> str:
        """A sequence that goes home."""
        return f'name = "{name}"\n\n[[step]]\ngoto = "home"\n'

    def is_one(self, path: Path) -> bool:
        """Whether a file describes a sequence, or is no TOML."""
        try:
            return is_sequence(path)
        except InputError:
            return True

    def check(self, text: str, file: Path) -> None:
        """Raise InputError, with step and key, if the text is no sequence."""
        Sequence.of_table(toml_table.parse(text, str(file)), self.arm)

    def check_to_open(self, text: str, file: Path) -> None:
        """Raise InputError if the text is no sequence, or its steps cannot be edited here."""
        table = toml_table.parse(text, str(file))
        if len(TomlBlocks(text, _STEP).tables) != len(table.peek(_STEP) or ()):
            raise InputError(
                f"{file.name}: its steps are not written as [[step]]", "write them so, or edit it as text"
            )
        self.check(text, file)

    @property
    def is_open(self) -> bool:
        """Whether there is something to edit."""
        return bool(self.text)

    # steps

    @property
    def steps(self) -> list[dict[str, str]]:
        """The keys and values of each step, as text."""
        return [{key: text_of(value) for key, value in step.items()} for step in self._values.get(_STEP, [])]

    @property
    def depths(self) -> list[int]:
        """How many repeats each step is within."""
        found, depth = [], 0
        for step in self.steps:
            depth -= "end" in step
            found.append(max(0, depth))
            depth += "repeat" in step
        return found

    def set(self, index: int, key: str, text: str) -> None:
        """Set the value of a step's key; "" removes the key."""
        if text != self.steps[index].get(key, ""):
            self._edit(lambda blocks: blocks.change(index, lambda table: put(table, key, text)))

    def set_kind(self, index: int, kind: str) -> None:
        """Change the kind of a step; its comments are kept."""

        def change(table: Any) -> None:
            for key in list(table):
                del table[key]
            table[kind] = toml_table.typed(_FIRST.get(kind, "name"))

        if kind_of(self.steps[index]) != kind:
            self._edit(lambda blocks: blocks.change(index, change))

    def add(self, index: int, values: dict[str, Any] | None = None) -> None:
        """Insert a step before ``index``; default: to go home."""
        self._edit(lambda blocks: blocks.insert(index, values or {"goto": "home"}))

    def copy(self, index: int) -> None:
        """Repeat a step after it."""
        self.add(index + 1, dict(self._values[_STEP][index]))

    def delete(self, index: int) -> None:
        """Remove a step, with its comments."""
        self._edit(lambda blocks: blocks.tables.pop(index))

    def move(self, index: int, by: int) -> None:
        """Move a step ``by`` places, with its comments; not beyond the first or last."""
        if 0 <= index + by < len(self.steps):
            self._edit(lambda blocks: blocks.move(index, by))

    def _edit(self, change: Callable[[TomlBlocks], object]) -> None:
        blocks = TomlBlocks(self.text, _STEP)
        change(blocks)
        self._change(blocks.text)

    def choices(self, key: str, jobs: list[str]) -> list[str]:
        """What a key can name, of the arm and the folder; empty for what is typed. ``jobs``: the folder's."""
        steps = self.steps
        pallets = [pallet.name for pallet in self.arm.pallets]
        return {
            "goto": ["home", *(posture.name for posture in self.arm.postures)],
            "run": jobs,
            "output": [one.name for one in self.arm.outputs],
            "wait_input": [one.name for one in self.arm.inputs],
            "holds": [NOTHING, *(load.name for load in self.arm.loads)],
            "tool": [NOTHING, *(tool.name for tool in self.arm.tools)],
            "call": self.files(),
            "count": sorted({step["count"] for step in steps if "count" in step}),
            "repeat": ["for ever", *pallets],
            "place": pallets,
            "leave": pallets,
            "end": ["repeat"],
            "active": ["true", "false"],
            "reverse": ["true", "false"],
            "on_timeout": list(ON_TIMEOUT),
            "to": [name for one in self.arm.outputs for name, _ in one.states],
        }.get(key, [])

    # the sequence and its plan

    def sequence(self) -> Sequence:
        """The sequence of the steps; raises InputError, with step and key, if it is invalid."""
        if not self.is_open:
            raise InputError("no sequence is open", "choose a file")
        return Sequence.of_table(toml_table.parse(self.text, str(self.target)), self.arm)

    @property
    def plan(self) -> Plan | None:
        """The plan of the present steps; None if they were not planned."""
        return self._plan[1] if self._plan[0] == self.version else None

    def planned(self, plan: Plan, version: int) -> None:
        """Keep a plan of the steps as they were at ``version``."""
        self._plan = version, plan


def kind_of(step: dict[str, str]) -> str:
    """The kind of a step."""
    return next((kind for kind in KINDS if kind in step), "goto")
