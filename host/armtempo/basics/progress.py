"""Progress of long work: a callback with the work done, which can end the work by an exception."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

Progress = Callable[[float, float], object]
"""Called repeatedly with the work done and the total, in the same unit; an exception ends the work. If it has
a method ``stage``, that is called with a word or two about the present work."""

_EVERY_S = 0.05
"""Interval at which ``alive`` calls the progress again."""


def part(progress: Progress | None, number: int, parts: int) -> Progress | None:
    """The progress of part ``number`` (from 0) of ``parts`` equal parts."""
    return None if progress is None else _Part(progress, number, parts)


class _Part:
    def __init__(self, progress: Progress, number: int, parts: int) -> None:
        self._progress, self._number, self._parts = progress, number, parts

    def __call__(self, done: float, whole: float) -> None:
        self._progress(self._number + done / whole, self._parts)

    def stage(self, name: str) -> None:
        _tell(self._progress, name)


class _Watched:
    """A progress, with the values and the time of its last call."""

    def __init__(self, progress: Progress) -> None:
        self.progress = progress
        self._at = 0.0, 1.0
        self._called_s = time.monotonic()

    def __call__(self, done: float, whole: float) -> None:
        self._at, self._called_s = (done, whole), time.monotonic()
        self.progress(done, whole)

    def alive(self) -> None:
        if time.monotonic() - self._called_s >= _EVERY_S:
            self(*self._at)

    def stage(self, name: str) -> None:
        _tell(self.progress, name)


_watched: ContextVar[_Watched | None] = ContextVar("_watched", default=None)


@contextmanager
def watched(progress: Progress | None) -> Iterator[Progress]:
    """A context with a progress that ``stage`` and ``alive`` reach from any depth of calls."""
    whole = _Watched(progress or _silent)
    token = _watched.set(whole)
    try:
        yield whole
    finally:
        _watched.reset(token)


def stage(name: str) -> None:
    """Report what is being done from now on."""
    if (current := _watched.get()) is not None:
        current.stage(name)


def alive() -> None:
    """Call the progress again with its last values, so that it can end the work."""
    if (current := _watched.get()) is not None:
        current.alive()


def _tell(progress: Progress, name: str) -> None:
    method = getattr(progress, "stage", None)
    if method is not None:
        method(name)


def _silent(_done: float, _whole: float) -> None:
    """Progress that nobody watches."""
