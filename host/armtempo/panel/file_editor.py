"""A file of the project folder that the panel edits: its text is what is edited, so nothing in it is lost."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import tomlkit

from armtempo.basics import toml_table
from armtempo.basics.atomic_file import replace_text
from armtempo.basics.errors import InputError
from armtempo.basics.text import hidden
from armtempo.model.arm import Arm
from armtempo.model.job import NAME_RULE, is_name

_MOST_UNDONE = 100


class FileEditor(ABC):
    """The edited text and what can be undone; ``folder``: the only folder that is written to."""

    kind = ""
    """What the file describes, for messages."""

    def __init__(self, arm: Arm, folder: Path) -> None:
        self.arm, self.folder = arm, folder
        self.file: Path | None = None
        """None for what was never saved."""
        self.version = 0
        """Incremented at each change."""
        self.text = ""
        """The file as it would be written."""
        self._values: dict[str, Any] = {}
        self._saved = ""
        self._undo: list[str] = []
        self.looked_ns = -1
        """Time of the file when it was last compared with what was saved."""
        self._is_other = False
        self._kinds: dict[Path, tuple[int, bool]] = {}
        """Whether each file of the folder is one of this kind, with the time of what was read."""

    @abstractmethod
    def new_text(self, name: str) -> str:
        """The text of a new file."""

    @abstractmethod
    def is_one(self, path: Path) -> bool:
        """Whether a file is of this kind, or no TOML: opening it says why it cannot be edited."""

    @abstractmethod
    def check(self, text: str, file: Path) -> None:
        """Raise InputError if the text is not valid for ``file``."""

    def take_arm(self, arm: Arm) -> None:
        """Take another version of the arm."""
        self.arm = arm

    def check_to_open(self, text: str, file: Path) -> None:
        """As ``check``, for a file that is opened."""
        self.check(text, file)

    # files

    def files(self) -> list[str]:
        """Names of the files of this kind in the folder; only those that have changed are read."""
        known, self._kinds = self._kinds, {}
        for path in sorted(self.folder.glob("*.toml")):
            with suppress(OSError):  # it is gone
                changed_ns = path.stat().st_mtime_ns
                before = known.get(path)
                is_one = before[1] if before and before[0] == changed_ns else self.is_one(path)
                self._kinds[path] = changed_ns, is_one
        return [path.name for path, (_, is_one) in self._kinds.items() if is_one]

    def open(self, name: str) -> None:
        """Edit a file of the folder; raises InputError if it is none of this kind."""
        self.take(*self.to_open(name))

    def load(self, file: Path) -> None:
        """Edit a file; raises InputError if it is not valid."""
        self.take(file, self._checked(file))

    def to_open(self, name: str) -> tuple[Path, str]:
        """A file of the folder and its text, checked in any thread; raises InputError if it is none of this kind."""
        if name not in self.files():
            raise InputError(f"{name}: there is no such {self.kind} in the project folder", "choose another")
        if character := hidden(name):
            raise InputError(
                f"{name}: the file's name has the character {character}, which cannot be shown",
                "rename the file",
            )
        return (file := self.folder / name), self._checked(file)

    def _checked(self, file: Path) -> str:
        self.check_to_open(text := _read(file), file)
        return text

    def take(self, file: Path, text: str) -> None:
        """Edit the text of a file that was checked."""
        self._set(text)
        self._took(file, text)

    def _took(self, file: Path, text: str) -> None:
        self.file, self._saved = file, text
        self.looked_ns, self._is_other = -1, False

    def is_other_on_disk(self) -> bool:
        """Whether another program has changed the file since; it is read only if its time has changed."""
        if self.file is None:
            return False
        with suppress(OSError, InputError):  # it is gone; saving makes it again
            if (now_ns := self.file.stat().st_mtime_ns) != self.looked_ns:
                self.looked_ns, self._is_other = now_ns, _read(self.file) != self._saved
        return self._is_other

    @property
    def has_changes(self) -> bool:
        """Whether something would be lost with what is edited."""
        return self.can_undo and not self.is_saved

    def new(self, name: str) -> None:
        """Edit a new one; raises InputError for a name that is not valid on the board."""
        self._check_name(name)
        self._set(self.new_text(name))
        self.file = None

    def save(self) -> Path:
        """Write the file, as it is edited; raises InputError, without writing, if it is not valid."""
        file = self.target
        if self.file is None and file.exists():
            raise InputError(f"{file.name} exists already", f"save the {self.kind} under another name")
        if self.file is not None and _read(file) != self._saved:
            raise InputError(
                f"{file.name} was changed by another program since it was opened",
                f"open it again, or save the {self.kind} under another name",
            )
        return self._write(file)

    def save_as(self, name: str) -> Path:
        """Write it under another name, which becomes the edited one; raises InputError, with no change, as ``save``."""
        self._check_name(name)
        file = self.folder / f"{name}.toml"
        if file.exists():
            raise InputError(f"{file.name} exists already", "give another name")
        before, undo = self.text, self._undo
        self.set_option("name", name)
        try:
            return self._write(file)
        except InputError:
            self._set(before)
            self._undo = undo
            raise

    @property
    def target(self) -> Path:
        """The file that is written; default: one in the folder."""
        return self.file or self.folder / f"{self.name}.toml"

    def _write(self, file: Path) -> Path:
        if not file.resolve().is_relative_to(self.folder.resolve()):
            raise InputError(
                f"{file} is outside of the project folder", "copy it there; the panel writes nothing else"
            )
        self.check(self.text, file)
        replace_text(file, self.text)
        self._took(file, self.text)
        return file

    def _check_name(self, name: str) -> None:
        if not is_name(name):
            raise InputError(f"{name!r} is not a valid name of a {self.kind}", f"give {NAME_RULE}")

    # the text

    @property
    def name(self) -> str:
        """The name in the file."""
        return self.option("name")

    @property
    def content(self) -> dict[str, Any]:
        """What the text says."""
        return self._values

    @property
    def is_saved(self) -> bool:
        """Whether the file has every change."""
        return self.file is not None and self.text == self._saved

    def option(self, key: str) -> str:
        """The value of a key, as it is typed; "" if it is not given."""
        return text_of(self._values.get(key))

    def set_option(self, key: str, text: str) -> None:
        """Set a key; "" removes it."""
        if text != self.option(key):
            document = tomlkit.parse(self.text)
            put(document, key, text)
            self._change(tomlkit.dumps(document))

    @property
    def can_undo(self) -> bool:
        """Whether there is a change to undo."""
        return bool(self._undo)

    def undo(self) -> None:
        """Undo the last change."""
        if self._undo:
            undone = self._undo[:-1]
            self._set(self._undo[-1])
            self._undo = undone

    def rewritten(self, change: Callable[[str], str]) -> Callable[[], None]:
        """Change the text, what was saved of it, and what can be undone, as another part of the panel changes the file.

        Errors of ``change`` come at once; nothing is changed until what is returned is called.
        """
        text, saved, undo = change(self.text), change(self._saved), list(map(change, self._undo))

        def take() -> None:
            if text != self.text:
                self._set(text)
            self._saved, self._undo = saved, undo

        return take

    def _change(self, text: str) -> None:
        before = [*self._undo[-_MOST_UNDONE:], self.text]
        self._set(text)
        self._undo = before

    def _set(self, text: str) -> None:
        self._values = tomlkit.parse(text).unwrap()
        self.text = text
        self._undo = []
        self.version += 1


def put(table: Any, key: str, text: str) -> None:
    """Set a key of a table to a typed value; "" removes it."""
    if text:
        table[key] = toml_table.typed(text)
    else:
        table.pop(key, None)


def text_of(value: Any) -> str:
    """A value of a TOML file as it is typed, without the quotes of a text; "" for None."""
    if value is None:
        return ""
    if isinstance(value, str):
        return value
    if isinstance(value, bool):
        return str(value).lower()
    return str(value)


def _read(file: Path) -> str:
    try:
        return file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{file}: cannot be read: {error}", "check the file") from None
