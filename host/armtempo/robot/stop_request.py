"""Requests to stop a motion: by Ctrl-C or SIGTERM, from a thread, from another program."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import current_thread, main_thread
from types import FrameType, TracebackType
from typing import Self

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Stopped(KeyboardInterrupt):
    """A motion was brought to rest before its end by a stop request."""


class StopRequest:
    """A request to stop; the call that waits for a motion polls ``wanted`` and brakes.

    As a context it also catches signals: the first sets ``wanted``, so that no frame is cut and the board can
    brake; the second raises KeyboardInterrupt. A context with a request raises Stopped at its end. Any thread
    may set ``wanted``; signals only reach the main thread.
    """

    def __init__(self) -> None:
        self._wanted = False
        self.by = ""
        """Who asked for the stop; "" for a signal or this program."""
        self._wakes: list[Callable[[], object]] = []

    @property
    def wanted(self) -> bool:
        """Whether the stop was requested."""
        return self._wanted

    @wanted.setter
    def wanted(self, wanted: bool) -> None:
        self._wanted = wanted
        if wanted:
            for wake in list(self._wakes):
                wake()

    @contextmanager
    def waking(self, wake: Callable[[], object]) -> Iterator[None]:
        """Within this context ``wake`` is called with the request, so that a call that waits looks at it."""
        self._wakes.append(wake)
        try:
            yield
        finally:
            self._wakes.remove(wake)

    def ask(self, by: str) -> None:
        """Request the stop; ``by``: who asks, for messages."""
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
        """Raise Stopped if the stop was requested."""
        if self.wanted:
            raise Stopped(*([f"{self.by} asked for a stop"] if self.by else []))

    def _note(self, number: int, frame: FrameType | None) -> None:
        if self.wanted:
            raise KeyboardInterrupt
        self.wanted = True


@contextmanager
def stoppable(given: StopRequest | None) -> Iterator[StopRequest]:
    """A stop request for a motion: ``given``, else a new one that catches signals.

    Raises Stopped at its end if the stop was requested.
    """
    if given is None:
        with StopRequest() as own:
            yield own
    else:
        yield given
        given.check()
