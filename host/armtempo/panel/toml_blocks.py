"""The tables [[NAME]] of a TOML text as blocks of lines, each with the comments right above it: moved as they are."""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable
from typing import Any

import tomlkit

from armtempo.basics.errors import InputError

_HEADER = re.compile(r"\s*\[\[?\s*[A-Za-z_\"'][^\[\],]*\]\]?\s*(#.*)?$")


class TomlBlocks:
    """The text before the tables, each table, and the text after them."""

    def __init__(self, text: str, name: str) -> None:
        self.name = name
        self.head = self.tail = ""
        self.tables: list[str] = []
        self._split(text.splitlines(keepends=True))

    def _split(self, lines: list[str]) -> None:
        ours = re.compile(rf"\s*\[\[\s*{self.name}\s*\]\]\s*(#.*)?$")
        starts = [_with_comments(lines, at) for at, line in enumerate(lines) if ours.match(line)]
        others = [at for at, line in enumerate(lines) if _HEADER.match(line) and not ours.match(line)]
        after = [at for at in others if starts and at > starts[-1]]
        end = _with_comments(lines, after[0]) if after else len(lines)
        if starts and any(starts[0] < at < starts[-1] for at in others):
            raise InputError(
                f"its [[{self.name}]] tables are written in a way that cannot be changed here",
                "write them one after the other, without other tables among them",
            )
        bounds = [*starts, end]
        self.head = "".join(lines[: bounds[0]])
        self.tables = ["".join(lines[low:high]) for low, high in itertools.pairwise(bounds)]
        self.tail = "".join(lines[end:]) if starts else ""
        if not starts:
            self.head = "".join(lines)

    @property
    def text(self) -> str:
        """The whole text, with an empty line between two tables."""
        parts = [part.rstrip("\n") + "\n" for part in (self.head, *self.tables, self.tail) if part.strip()]
        return "\n".join(parts)

    def change(self, number: int, change: Callable[[Any], object]) -> None:
        """Change the keys of a table."""
        document = tomlkit.parse(self.tables[number])
        change(document[self.name][0])
        self.tables[number] = tomlkit.dumps(document)

    def insert(self, number: int, values: dict[str, Any]) -> None:
        """Insert a table before ``number``."""
        table = tomlkit.table()
        table.update(values)
        tables = tomlkit.aot()
        tables.append(table)
        self.tables.insert(number, tomlkit.dumps({self.name: tables}))

    def move(self, number: int, by: int) -> None:
        """Move a table ``by`` places."""
        self.tables.insert(number + by, self.tables.pop(number))


def _with_comments(lines: list[str], header: int) -> int:
    """The first line of the comments right above a header."""
    while header and lines[header - 1].lstrip().startswith("#"):
        header -= 1
    return header
