"""Reading TOML with every key checked: errors name the file, the key, the value and what is allowed."""

from __future__ import annotations

import math
import reprlib
import tomllib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from armtempo.basics.atomic_file import os_reason
from armtempo.basics.errors import InputError
from armtempo.basics.kinds import is_number, is_text, is_whole
from armtempo.basics.text import did_you_mean, misspelt, on_one_line

_REQUIRED: Any = object()


def read(path: Path | str) -> Table:
    """The top table of a TOML file.

    Raises InputError if the file is missing, unreadable or not TOML.
    """
    try:
        text = Path(path).read_text(encoding="utf-8-sig")  # some editors begin a file with a byte order mark
    except FileNotFoundError:
        raise InputError(f"{path}: no such file", "check the path") from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(
            f"{path}: cannot be read: {os_reason(error)}",
            "check that it is a text file in UTF-8 that you may read",
        ) from None
    return parse(text, str(path))


def parse(text: str, file: str) -> Table:
    """The top table of TOML text; ``file`` names it in messages. Raises InputError if it is not TOML."""
    try:
        return Table(tomllib.loads(text), file)
    except (
        ValueError,
        RecursionError,
    ) as error:  # tomllib also raises other errors, for numbers of 5000 digits
        raise InputError(
            f"{file}: not valid TOML: {error}",
            "'armtempo import' makes a job file of a table"
            if file.lower().endswith((".csv", ".tsv"))
            else "correct that place; strings are written in quotes, tables in [brackets]",
        ) from None


def typed(text: str) -> Any:
    """The value of a typed text: a number, boolean or list if it is one in TOML, else the text."""
    try:
        value = tomllib.loads(f"x = {text}")
    except (ValueError, RecursionError):
        return text
    return value["x"] if len(value) == 1 and isinstance(value["x"], bool | int | float | list) else text


class Table:
    """One TOML table; each getter checks one key, ``done`` refuses keys that no getter has read."""

    def __init__(self, values: Mapping[str, Any], file: str, place: str = "") -> None:
        self._values = values
        self.file = file
        self.place = place
        self._asked: list[str] = []

    def fail(self, key: str, allowed: str) -> InputError:
        """The error for a key, with its value and what is allowed."""
        name = f"{self.place}{on_one_line(key)}"
        if key not in self._values:
            return InputError(
                f"{self.file}: {name} is missing", f"write {name} = {allowed}{self._misspelt(key)}"
            )
        value = reprlib.repr(self._values[key])
        return InputError(f"{self.file}: {name} = {value} is not allowed", f"give {allowed}")

    def misplaced(self, key: str, cure: str) -> InputError:
        """The error for a key that may not be given beside the others."""
        value = reprlib.repr(self._values[key])
        return InputError(f"{self.file}: {self.place}{on_one_line(key)} = {value} is not allowed here", cure)

    def _misspelt(self, key: str) -> str:
        """A note about a similar key in the table; "" if there is none."""
        near = misspelt(key, [other for other in self._values if other not in self._asked])
        return f"; {self.place}{near} is there: is it misspelt?" if near else ""

    def has(self, key: str) -> bool:
        """Whether the key is given."""
        return key in self._values

    def peek(self, key: str) -> Any:
        """The unchecked value, or None; for keys that allow several types."""
        return self._values.get(key)

    def is_text(self, key: str) -> bool:
        """Whether the key is given, as a text."""
        return isinstance(self._values.get(key), str)

    def names(self) -> tuple[str, ...]:
        """The table's keys, in the order of the file."""
        return tuple(self._values)

    def known(self, *keys: str) -> None:
        """Allow these keys, even if no getter reads them."""
        self._asked.extend(keys)

    def _get(self, key: str, default: Any, allowed: str) -> Any:
        self._asked.append(key)
        if key in self._values:
            return self._values[key]
        if default is _REQUIRED:
            raise self.fail(key, allowed)
        return default

    def number(
        self,
        key: str,
        default: float = _REQUIRED,
        *,
        least: float = -math.inf,
        most: float = math.inf,
    ) -> float:
        """A finite number with ``least`` <= value <= ``most``."""
        allowed = "a number" + _range_text(least, most)
        value = self._get(key, default, allowed)
        if not is_number(value) or not (least <= value <= most):
            raise self.fail(key, allowed)
        return float(value)

    def integer(self, key: str, default: int = _REQUIRED, *, least: int, most: int) -> int:
        """A whole number from ``least`` to ``most``."""
        allowed = f"a whole number from {least} to {most}"
        value = self._get(key, default, allowed)
        if not is_whole(value) or not least <= value <= most:
            raise self.fail(key, allowed)
        return int(value)

    def choice(
        self, key: str, choices: Sequence[Any], default: Any = _REQUIRED, allowed: str | None = None
    ) -> Any:
        """One of ``choices``; ``allowed``: their description in the message, if there are many."""
        allowed = allowed or "one of " + ", ".join(repr(choice) for choice in choices)
        value = self._get(key, default, allowed)
        if not any(type(value) is type(choice) and value == choice for choice in choices):
            raise self.fail(key, allowed)
        return value

    def boolean(self, key: str, default: bool) -> bool:
        """True or false."""
        return bool(self.choice(key, (True, False), default))

    def text(self, key: str, default: str = _REQUIRED) -> str:
        """A text that is not empty and has no control characters."""
        value = self._get(key, default, "a text")
        if not isinstance(value, str) or not value.strip():
            raise self.fail(key, "a text that is not empty")
        if not is_text(value):
            raise self.fail(key, "a text on one line, without control characters")
        return value

    def numbers(
        self, key: str, count: int, default: Any = _REQUIRED, *, most: float = math.inf
    ) -> tuple[float, ...]:
        """A list of ``count`` finite numbers from -``most`` to ``most``."""
        allowed = f"a list of {count} numbers" + (f" from {-most:g} to {most:g}" if most < math.inf else "")
        value = self._get(key, default, allowed)
        if not isinstance(value, list | tuple) or len(value) != count or not all(map(is_number, value)):
            raise self.fail(key, allowed)
        if any(abs(number) > most for number in value):
            raise self.fail(key, allowed)
        return tuple(float(number) for number in value)

    def array(self, key: str, allowed: str) -> list[Any]:
        """A list of anything, at least one entry."""
        value = self._get(key, _REQUIRED, allowed)
        if not isinstance(value, list) or not value:
            raise self.fail(key, allowed)
        return value

    def table(self, key: str) -> Table | None:
        """A table inside this one, or None if it is not given."""
        value = self._get(key, None, "a table")
        if value is None:
            return None
        if not isinstance(value, dict):
            raise self.fail(key, "a table")
        return Table(value, self.file, f"{self.place}{on_one_line(key)}.")

    def named_tables(self, key: str) -> list[tuple[str, Table]]:
        """The tables [key.NAME] with their names, in the order of the file; empty if the key is not given."""
        outer = self.table(key)
        if outer is None:
            return []
        found = []
        for name in outer.rest():
            table = outer.table(name)
            if table is not None:
                found.append((name, table))
        return found

    def tables(self, key: str, called: Callable[[int], str] | None = None) -> list[Table]:
        """A list of tables ([[key]]), at least one; ``called``: the name of each in messages, by its number from 0."""
        entries = self.array(key, f"a list of tables, [[{key}]]")
        if not all(isinstance(entry, dict) for entry in entries):
            raise self.fail(key, f"a list of tables, [[{key}]]")
        names = map(called or (lambda n: f"{key}[{n + 1}]"), range(len(entries)))
        return [
            Table(entry, self.file, f"{self.place}{name}.")
            for entry, name in zip(entries, names, strict=True)
        ]

    def rest(self) -> dict[str, Any]:
        """All values of the table, for a caller that checks the keys itself."""
        self._asked.extend(self._values)
        return dict(self._values)

    def done(self) -> None:
        """Raise InputError for the first key that no getter asked for."""
        for key in self._values:
            if key in self._asked:
                continue
            meant = did_you_mean(key, self._asked).removeprefix("; ")
            known = f"known here: {', '.join(sorted(set(self._asked)))}"
            raise InputError(
                f"{self.file}: {self.place}{on_one_line(key)}: unknown key",
                f"{meant} {known}" if meant else known,
            )


def _range_text(least: float, most: float) -> str:
    parts = []
    if least > -math.inf:
        parts.append(f"of at least {least:g}")
    if most < math.inf:
        parts.append(f"of at most {most:g}")
    return " " + " and ".join(parts) if parts else ""
