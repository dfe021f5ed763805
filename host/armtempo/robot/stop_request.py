"""Ctrl-C and SIGTERM while something moves: asked for first, forced the second time."""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Timer, main_thread
from types import FrameType, TracebackType
from typing import Self

_SIGNALS = (signal.SIGINT, signal.SIGTERM)
_WAIT_S = 0.01
_MOST_WAITS = 300
"""Longer than any import takes; whoever runs the command while importing it is interrupted all the same."""


class StopRequest:
    """While the context lasts the first signal sets ``wanted``; a second one raises KeyboardInterrupt.

    Thus a frame is never cut in the middle and the board can be told to brake.
    """

    def __init__(self) -> None:
        self.wanted = False

    def __enter__(self) -> Self:
        self._before = [signal.signal(number, self._note) for number in _SIGNALS]
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        for number, handler in zip(_SIGNALS, self._before, strict=True):
            signal.signal(number, handler)

    def _note(self, number: int, frame: FrameType | None) -> None:
        if self.wanted:
            raise KeyboardInterrupt
        self.wanted = True


class _Raise:
    """A signal handler that raises KeyboardInterrupt; while a module is imported, it waits with that.

    There an exception may be swallowed, by compiled modules for one.
    """

    def __init__(self) -> None:
        self._waiting = False
        self._waits = 0

    def __call__(self, number: int, frame: FrameType | None) -> None:
        if self._waiting:
            return
        if self._waits == _MOST_WAITS or not _importing(frame):
            raise KeyboardInterrupt
        self._waiting = True
        self._waits += 1
        timer = Timer(_WAIT_S, self._again, (number,))
        timer.daemon = True
        timer.start()

    def _again(self, number: int) -> None:
        self._waiting = False
        if sys.platform == "win32":
            signal.raise_signal(number)
        else:
            signal.pthread_kill(main_thread().ident or 0, number)  # it may be blocked by now


def _importing(frame: FrameType | None) -> bool:
    while frame and not frame.f_code.co_filename.startswith("<frozen importlib"):
        frame = frame.f_back
    return frame is not None


@contextmanager
def raised_by_signals() -> Iterator[None]:
    """Let Ctrl-C and SIGTERM raise KeyboardInterrupt: the program ends with everything closed and put away.

    Ctrl-C stays ignored where it is, as in a program that a shell has put into the background.
    """
    ignored = signal.getsignal(signal.SIGINT) == signal.SIG_IGN
    numbers = _SIGNALS[1:] if ignored else _SIGNALS
    before = [signal.getsignal(number) for number in numbers]
    handler = _Raise()
    try:
        for number in numbers:
            signal.signal(number, handler)
        yield
    finally:
        for number, earlier in zip(numbers, before, strict=True):
            signal.signal(number, earlier)
