"""Which presses are still meant: a command comes late, twice or out of order, or the state has changed meanwhile.

A page that gives a command sends with it a number, the state that it showed, and when it was pressed by the server's
own clock: the clock in a message, and the time since that came. The age that follows is never too small: the way of
the message to the page counts as well (of the last ones the page takes the one that came fastest).
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from threading import Lock
from typing import Self

from armtempo.basics.errors import InputError
from armtempo.panel import words

MOST_AGE_S = 0.3
"""A command that is older is dropped."""
_FUTURE_S = -0.2
"""Browsers round their clocks; a smaller age is none."""


@dataclass(frozen=True)
class Press:
    """What a page says of a press."""

    number: int
    """Of the page's presses, ascending."""
    state: int
    """Number of the state that the page showed."""
    made_s: float
    """When it was made, at the latest, by the server's clock."""

    @classmethod
    def of(cls, said: object) -> Self:
        """From a message of the page; raises InputError for anything else."""
        if isinstance(said, dict):
            number, state, made_s = said.get("number"), said.get("state"), said.get("made_s")
            if (
                type(number) is type(state) is int
                and isinstance(made_s, int | float)
                and math.isfinite(made_s)
            ):
                return cls(number, state, made_s)
        raise InputError(words.NO_PRESS, words.PRESS_AGAIN)

    def age_s(self, now_s: float) -> float:
        """How long ago it was, at most."""
        return now_s - self.made_s


class Presses:
    """The presses of all pages. All methods are thread-safe.

    ``state``: what a command depends on; a press that was made in sight of another one is not meant.
    """

    def __init__(self, state: Callable[[], object], clock: Callable[[], float] = time.monotonic) -> None:
        self._state, self.clock = state, clock
        self._lock = Lock()
        self._last: dict[str, int] = {}
        self._seen: object = None
        self._number = 0

    @property
    def state(self) -> int:
        """The number of the present state: another one after each change."""
        seen = self._state()
        with self._lock:
            if seen != self._seen:
                self._seen = seen
                self._number += 1
            return self._number

    def take(self, client: str, press: Press) -> None:
        """Accept a press, once; raises InputError if it is not meant any more."""
        state = self.state
        with self._lock:
            last = self._last.get(client, 0)
            self._last[client] = max(last, press.number)
        if press.number <= last:
            raise InputError(words.PRESS_PASSED, words.PRESS_AGAIN)
        if not _FUTURE_S < press.age_s(self.clock()) < MOST_AGE_S:
            raise InputError(words.PRESS_LATE, words.PRESS_AGAIN)
        if press.state != state:
            raise InputError(words.PRESS_OTHER_STATE, words.PRESS_AGAIN)

    def released(self, client: str, number: int) -> None:
        """A button was released; its press, if that comes later, is void."""
        with self._lock:
            self._last[client] = max(self._last.get(client, 0), number)

    def gone(self, client: str) -> None:
        """A page was closed for good."""
        with self._lock:
            self._last.pop(client, None)
