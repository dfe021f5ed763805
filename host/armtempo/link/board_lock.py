"""A lock for talking to the board: threads of a program take turns, requests of other programs come first."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Self

_YIELD_S = 0.0002


class BoardLock:
    """A re-entrant lock; as a context it lets waiting ``in_a_hurry`` callers go first."""

    def __init__(self) -> None:
        self._lock = threading.RLock()
        self._holder: int | None = None
        self._depth = 0
        self._counting = threading.Lock()
        self._hurrying = 0

    def __enter__(self) -> Self:
        if self._holder != threading.get_ident():
            while self._hurrying:
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
    def in_a_hurry(self, timeout_s: float) -> Iterator[bool]:
        """Take the lock next; yields False if it is not free within ``timeout_s``."""
        self._count(1)
        try:
            mine = self._lock.acquire(timeout=timeout_s)
        finally:
            self._count(-1)
        if not mine:
            yield False
            return
        self._taken()
        try:
            yield True
        finally:
            self.__exit__(None, None, None)

    def _taken(self) -> None:
        self._holder = threading.get_ident()
        self._depth += 1

    def _count(self, change: int) -> None:
        with self._counting:
            self._hurrying += change
