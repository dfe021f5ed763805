"""Single keys from a terminal without Enter: termios on POSIX, msvcrt on Windows."""

from __future__ import annotations

import os
import select
import sys
import time
from contextlib import suppress
from typing import Any, Protocol, Self

END, INTERRUPT = "end", "ctrl-c"
"""Keys for the end of the input, and for Ctrl-C, which is a key here, not a signal."""
_POSIX = {
    "\x1b[A": "up",
    "\x1b[B": "down",
    "\x1b[C": "right",
    "\x1b[D": "left",
    "\x03": INTERRUPT,
    "\x04": END,
}
_POSIX |= {code.replace("[", "O"): name for code, name in _POSIX.items() if "[" in code}
_WINDOWS = {"H": "up", "P": "down", "M": "right", "K": "left"}
_WINDOWS_PREFIXES = "\x00\xe0"
_LOOK_S = 0.01


class Keys(Protocol):
    """A source of keys."""

    def read(self, timeout_s: float) -> str:
        """The next key, "" if none comes in time: a letter, or "up", "down", "left", "right", END, INTERRUPT."""

    def flush(self) -> None:
        """Discard keys that were pressed and not read."""


def is_terminal() -> bool:
    """Whether stdin is a terminal."""
    return sys.stdin.isatty()


def of_terminal() -> PosixKeys | WindowsKeys:
    """The keys of the terminal; a context that restores the terminal at its end."""
    return WindowsKeys() if os.name == "nt" else PosixKeys(sys.stdin.fileno())


def split(text: str) -> tuple[str, str]:
    """The first key in the text of a POSIX terminal, and the rest; ("", text) if an escape sequence is incomplete."""
    if text[:1] != "\x1b" or len(text) == 1:
        return _POSIX.get(text[:1], text[:1]), text[1:]
    if text[:2] not in ("\x1b[", "\x1bO"):
        return "", text[1:]
    for end in range(2, len(text)):
        if "@" <= text[end] <= "~":
            return _POSIX.get(text[: end + 1], ""), text[end + 1 :]
    return "", ""


class PosixKeys:
    """Keys of a POSIX terminal."""

    def __init__(self, fd: int) -> None:
        self._fd = fd
        self._text = ""
        self._before: list[Any] = []

    def __enter__(self) -> Self:
        import termios

        self._before = termios.tcgetattr(self._fd)
        now = termios.tcgetattr(self._fd)
        now[3] &= ~(termios.ICANON | termios.ECHO | termios.ISIG)
        now[6][termios.VMIN], now[6][termios.VTIME] = 1, 0
        termios.tcsetattr(self._fd, termios.TCSADRAIN, now)
        return self

    def __exit__(self, *failure: object) -> None:
        import termios

        with suppress(termios.error):  # the terminal was closed
            termios.tcsetattr(self._fd, termios.TCSAFLUSH, self._before)

    def read(self, timeout_s: float) -> str:
        until_s = time.monotonic() + timeout_s
        while True:
            while self._text:
                key, self._text = split(self._text)
                if key:
                    return key
            left_s = max(0.0, until_s - time.monotonic())
            if not select.select([self._fd], [], [], left_s)[0]:
                return ""
            data = os.read(self._fd, 256)
            if not data:
                return END
            self._text += data.decode(errors="ignore")

    def flush(self) -> None:
        while self.read(0.0) not in ("", END):
            pass


class WindowsKeys:
    """Keys of the Windows console."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *failure: object) -> None:
        self.flush()

    def read(self, timeout_s: float) -> str:
        import msvcrt

        console: Any = msvcrt
        until_s = time.monotonic() + timeout_s
        while not console.kbhit():
            if time.monotonic() >= until_s:
                return ""
            time.sleep(_LOOK_S)
        letter = str(console.getwch())
        if letter in _WINDOWS_PREFIXES:
            return _WINDOWS.get(str(console.getwch()), "")
        return _POSIX.get(letter, letter)

    def flush(self) -> None:
        while self.read(0.0):
            pass
