"""A lock for talking to the board: threads take turns, requests of other programs come first, stops before these."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Self

_YIELD_S = 0.0002


class BoardLock:
    """A re-entrant lock; as a context it lets waiting ``in_a_hurry`` and ``by_turns`` callers go first."""

    def __init__(self) -> None:
        self._lock = threading.RLock()
        self._holder: int | None = None
        self._depth = 0
        self._counting = threading.Lock()
        self._hurrying = self._stopping = 0
        self._by_turns: set[int] = set()
        """The threads in ``by_turns``."""

    def __enter__(self) -> Self:
        thread = threading.get_ident()
        if self._holder != thread:
            while self._stopping or (self._hurrying and thread not in self._by_turns):
                time.sleep(_YIELD_S)
        self._lock.acquire()
        self._taken()
        return self

    def __exit__(self, *failure: object) -> None:
        self._depth -= 1
        if not self._depth:
            self._holder = None
        self._lock.release()

    @contextmanager
    def in_a_hurry(self, timeout_s: float, stops: bool = False) -> Iterator[bool]:
        """Take the lock next; yields False if it is not free within ``timeout_s``.

        ``stops``: for a stop, which does not wait for the end of what ``by_turns`` callers ask.
        """
        self._count(1, int(stops))
        try:
            mine = self._lock.acquire(timeout=timeout_s)
        finally:
            self._count(-1, -int(stops))
        if not mine:
            yield False
            return
        self._taken()
        try:
            yield True
        finally:
            self.__exit__(None, None, None)

    @contextmanager
    def by_turns(self, timeout_s: float) -> Iterator[bool]:
        """For several commands, each of which takes the lock for itself: only stops come between them.

        Yields False if the lock is not free within ``timeout_s``.
        """
        thread = threading.get_ident()
        self._count(1, 0)
        try:
            mine = self._lock.acquire(timeout=timeout_s)
            if mine:
                self._lock.release()
            self._by_turns.add(thread)
            yield mine
        finally:
            self._by_turns.discard(thread)
            self._count(-1, 0)

    def _taken(self) -> None:
        self._holder = threading.get_ident()
        self._depth += 1

    def _count(self, hurrying: int, stopping: int) -> None:
        with self._counting:
            self._hurrying += hurrying
            self._stopping += stopping
