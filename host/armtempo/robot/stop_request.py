"""A stop that somebody asks for while something moves: by Ctrl-C or SIGTERM, from a thread, from another program."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import current_thread, main_thread
from types import FrameType, TracebackType
from typing import Self

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Stopped(KeyboardInterrupt):
    """A motion was brought to rest before its end because a stop was asked for."""


class StopRequest:
    """A stop that somebody asks for; what moves looks at ``wanted`` and brakes.

    As a context it also catches signals: the first sets ``wanted``, so that no frame is cut in the middle and
    the board can be told to brake, a second one raises KeyboardInterrupt. A context whose stop was asked for
    ends with Stopped. Any thread may set ``wanted``; signals only reach the main thread.
    """

    def __init__(self) -> None:
        self._wanted = False
        self.by = ""
        """Who asked for it, in words; "" for a signal or this program."""
        self.wake: Callable[[], object] = lambda: None
        """Called when the stop is asked for; wakes whatever waits for ``wanted``."""

    @property
    def wanted(self) -> bool:
        """Whether the stop was asked for."""
        return self._wanted

    @wanted.setter
    def wanted(self, wanted: bool) -> None:
        self._wanted = wanted
        if wanted:
            self.wake()

    def ask(self, by: str) -> None:
        """Ask for the stop, as ``by`` in words."""
        self.by = by
        self.wanted = True

    def __enter__(self) -> Self:
        numbers = _SIGNALS if current_thread() is main_thread() else ()
        self._before = {number: signal.signal(number, self._note) for number in numbers}
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)
        if value is None:
            self.check()

    def check(self) -> None:
        """Raise Stopped where a stop was asked for."""
        if self.wanted:
            raise Stopped(*([f"{self.by} asked for a stop"] if self.by else []))

    def _note(self, number: int, frame: FrameType | None) -> None:
        if self.wanted:
            raise KeyboardInterrupt
        self.wanted = True


@contextmanager
def stoppable(given: StopRequest | None) -> Iterator[StopRequest]:
    """A stop request for something that moves: the one that is ``given``, else a new one that catches signals.

    Ends with Stopped where the stop was asked for.
    """
    if given is None:
        with StopRequest() as own:
            yield own
    else:
        yield given
        given.check()
