"""Fields that show what a file has: what is typed into one stays, whatever changes in the others."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from armtempo.basics.errors import InputError
from armtempo.panel import words


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


@contextmanager
def of_a_row() -> Iterator[None]:
    """A context that uses a row by its number: InputError if a press just before has removed it."""
    try:
        yield
    except IndexError:
        raise InputError(words.ROW_GONE, words.LOOK_AGAIN) from None


@contextmanager
def in_words(of: Callable[[str], str]) -> Iterator[None]:
    """A context whose InputError on a file has its texts by ``of``: with the names of fields, not of keys."""
    try:
        yield
    except InputError as error:
        raise InputError(of(error.problem), of(error.hint)) from None
