"""Fields that show what a file has: what is typed into one stays, whatever changes in the others."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass
class _Field:
    show: Callable[[Any], object]
    value: Callable[[], object]
    shown: object


class Fields:
    """The fields of a part of a page."""

    def __init__(self) -> None:
        self._fields: list[_Field] = []

    def add(self, show: Callable[[Any], object], value: Callable[[], object]) -> None:
        """A field that was built with ``value()``; ``show`` puts another one in its place."""
        self._fields.append(_Field(show, value, value()))

    def clear(self) -> None:
        """They are built anew."""
        self._fields.clear()

    def look(self) -> None:
        """Show what has changed in the file. In a field where nothing has somebody may be typing."""
        for field in self._fields:
            if (now := field.value()) != field.shown:
                field.shown = now
                field.show(now)
