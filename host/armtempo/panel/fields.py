"""Fields that show what a file has: what is typed into one stays, whatever changes in the others."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from nicegui import ui
from nicegui.element import Element

from armtempo.basics.errors import InputError
from armtempo.panel import words


@dataclass
class _Field:
    element: Element
    show: Callable[[Any], object]
    value: Callable[[], object]
    shown: object


class Fields:
    """The fields of a part of a page."""

    def __init__(self) -> None:
        self._fields: list[_Field] = []

    def add(
        self, element: Any, value: Callable[[], object], show: Callable[[Any], object] | None = None
    ) -> None:
        """An element that was built with ``value()``; ``show``, or its ``set_value``, shows another one."""
        self._fields.append(_Field(element, show or element.set_value, value, value()))

    def clear(self) -> None:
        """They are built anew."""
        self._fields.clear()

    def look(self) -> None:
        """Show what has changed in the file. In a field where nothing has somebody may be typing."""
        for field in self._fields:
            if (now := field.value()) != field.shown:
                field.shown = now
                field.show(now)

    def send_again(self) -> None:
        """What the file has: what was typed while the connection was broken has not arrived.

        Nothing is built anew, which would close a list that is open.
        """
        for field in self._fields:
            field.element.update()
            if isinstance(field.element, ui.input):
                field.element.run_method("updateValue")


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
