"""Ctrl-C and SIGTERM while a command runs: KeyboardInterrupt, so that everything is closed and put away."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_AGAIN_S = 0.01
_MOST_WAITS = 300
"""Longer than any import takes; whoever runs a command while importing is interrupted all the same."""


@contextmanager
def raised_by_signals() -> Iterator[None]:
    """Let Ctrl-C and SIGTERM raise KeyboardInterrupt.

    Ctrl-C stays ignored where it is, as in a program that a shell has put into the background.
    """
    ignored = signal.getsignal(signal.SIGINT) == signal.SIG_IGN
    numbers = [signal.SIGTERM] if ignored else [signal.SIGTERM, signal.SIGINT]
    numbers += [signal.SIGALRM] if hasattr(signal, "setitimer") else []
    handler = _Interrupt()
    before = {number: signal.signal(number, handler) for number in numbers}
    try:
        yield
    finally:
        waiting = hasattr(signal, "setitimer") and signal.setitimer(signal.ITIMER_REAL, 0.0)[0] > 0.0
        for number, earlier in before.items():
            signal.signal(number, earlier)
        if waiting:
            raise KeyboardInterrupt


class _Interrupt:
    """Raises KeyboardInterrupt; during an import, where compiled modules may swallow it, SIGALRM tries again."""

    def __init__(self) -> None:
        self._waits = 0

    def __call__(self, number: int, frame: FrameType | None) -> None:
        if hasattr(signal, "setitimer") and self._waits < _MOST_WAITS and _importing(frame):
            self._waits += 1
            signal.setitimer(signal.ITIMER_REAL, _AGAIN_S)
        else:
            raise KeyboardInterrupt


def _importing(frame: FrameType | None) -> bool:
    while frame and not frame.f_code.co_filename.startswith("<frozen importlib"):
        frame = frame.f_back
    return frame is not None
