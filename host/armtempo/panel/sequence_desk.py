"""The sequence that the panel edits, and its file; comments are kept."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import tomlkit
from tomlkit.items import AoT, Table

from armtempo.basics import toml_table
from armtempo.basics.atomic_file import replace_text
from armtempo.basics.errors import InputError
from armtempo.model.arm import Arm
from armtempo.model.parts import NOTHING
from armtempo.model.sequence import Sequence, is_sequence
from armtempo.model.sequence_plan import SequencePlan

KINDS: dict[str, tuple[str, ...]] = {
    "goto": (),
    "run": (),
    "output": ("to", "holds", "wait_s"),
    "holds": (),
    "wait_s": (),
    "wait_input": ("active", "timeout_s", "on_timeout"),
    "count": (),
    "repeat": (),
    "end": (),
    "call": (),
}
"""Kinds of steps, with their further keys."""
_FIRST = {"goto": "home", "holds": NOTHING, "wait_s": "1", "repeat": "for ever", "end": "repeat"}


class SequenceDesk:
    """The steps of a file; ``folder``: the only folder that is written to."""

    def __init__(self, arm: Arm, folder: Path) -> None:
        self.arm, self.folder = arm, folder
        self.file: Path | None = None
        self.plan: SequencePlan | None = None
        """The last plan, of the steps at that time."""
        self.version = 0
        """Incremented at each change."""
        self._content = tomlkit.document()

    def files(self) -> list[str]:
        """Names of the sequence files in the folder."""
        found = []
        for path in sorted(self.folder.glob("*.toml")):
            try:
                if is_sequence(path):
                    found.append(path.name)
            except InputError:
                continue
        return found

    def open(self, name: str) -> None:
        """Edit a file of the folder; raises InputError if it is not a sequence, or its steps cannot be edited here."""
        if name not in self.files():
            raise InputError(f"{name}: there is no such sequence in the project folder", "choose another")
        file = self.folder / name
        content = tomlkit.parse(file.read_text(encoding="utf-8"))
        if not isinstance(content["step"], AoT):
            raise InputError(
                f"{name}: its steps are not written as [[step]]", "write them so, or edit it as text"
            )
        self.file, self._content, self.plan = file, content, None
        self.version += 1

    @property
    def steps(self) -> list[dict[str, str]]:
        """The keys and values of each step, as text."""
        return [{key: _text(value) for key, value in step.unwrap().items()} for step in self._tables]

    @property
    def _tables(self) -> list[Table]:
        steps = self._content.get("step")
        return list(steps.body) if isinstance(steps, AoT) else []

    def set(self, index: int, key: str, text: str) -> None:
        """Set the value of a step's key; "" removes the key."""
        table = self._tables[index]
        if text:
            table[key] = toml_table.typed(text)
        elif key in table:
            del table[key]
        self._changed()

    def set_kind(self, index: int, kind: str) -> None:
        """Change the kind of a step; its comments are kept."""
        table = self._tables[index]
        for key in list(table):
            del table[key]
        table[kind] = toml_table.typed(_FIRST.get(kind, "name"))
        self._changed()

    def add(self, index: int) -> None:
        """Insert a step before ``index``."""
        table = tomlkit.table()
        table["goto"] = "home"
        table.add(tomlkit.nl())
        tables = self._tables
        self._put([*tables[:index], table, *tables[index:]])

    def delete(self, index: int) -> None:
        """Remove a step, with its comments."""
        tables = self._tables
        del tables[index]
        self._put(tables)

    def move(self, index: int, by: int) -> None:
        """Move a step ``by`` places, with its comments; not beyond the first or last."""
        tables = self._tables
        if 0 <= index + by < len(tables):
            tables.insert(index + by, tables.pop(index))
            self._put(tables)

    def sequence(self) -> Sequence:
        """The sequence of the steps; raises InputError, with step and key, if it is invalid."""
        if self.file is None:
            raise InputError("no sequence is open", "choose a file")
        return Sequence.of_table(toml_table.parse(tomlkit.dumps(self._content), str(self.file)), self.arm)

    def save(self) -> Path:
        """Write the file; raises InputError, without writing, if the sequence is invalid."""
        sequence = self.sequence()
        file = Path(sequence.source)
        replace_text(file, tomlkit.dumps(self._content))
        return file

    def _put(self, tables: list[Table]) -> None:
        steps = tomlkit.aot()
        for table in tables:
            steps.append(table)
        self._content["step"] = steps
        self._changed()

    def _changed(self) -> None:
        self.plan = None
        self.version += 1


def kind_of(step: dict[str, str]) -> str:
    """The kind of a step."""
    return next((kind for kind in KINDS if kind in step), "goto")


def _text(value: Any) -> str:
    """A value as text, without the quotes of a string."""
    if isinstance(value, str):
        return value
    if isinstance(value, bool):
        return str(value).lower()
    return str(value)
