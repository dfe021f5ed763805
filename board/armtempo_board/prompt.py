"""Detects a request for MicroPython's prompt: a Ctrl-C (from mpremote, or typed twice) outside of frames, not
noise."""

import os
import time

from micropython import const

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

_QUIET_MS = const(50)
_CTRL_C = const(3)
_CONTROLS = b"\r\x03"


class PromptRequest:
    """Examines the bytes outside of frames; call ``clear`` at each valid frame."""

    def __init__(self) -> None:
        self._controls = 0  # CR and Ctrl-C since the last good frame; -1: other bytes among them
        self._interrupt = False  # whether one of them was Ctrl-C
        self._control_ms = 0

    def clear(self) -> None:
        """A valid frame was received."""
        self._controls = 0
        self._interrupt = False

    def comes(self, byte: int, now_ms: "Any") -> bool:
        """Whether the prompt is requested. ``byte``: a received byte; -1: none.

        After a silence only CR and Ctrl-C may come; three in a row count at once, also right after a frame.
        mpremote sends one Ctrl-A after them, which the prompt must get.
        """
        quiet = time.ticks_diff(now_ms, self._control_ms) >= _QUIET_MS
        if byte < 0:
            needed = 2 if quiet else 3
        else:
            needed = 3
            self._control_ms = now_ms
            self._count(byte, quiet)
        if self._controls >= needed and self._interrupt:
            self._controls = -1  # reported once; a request during a motion is dropped
            return True
        return False

    def _count(self, byte: int, quiet: bool) -> None:
        if byte not in _CONTROLS:
            self._controls = -1
        elif self._controls > 0 or quiet:
            self._controls = max(0, self._controls) + 1
            self._interrupt = self._interrupt or byte == _CTRL_C


def wait() -> None:
    """Wait for a request for the prompt, which would execute bytes of a host's frames as typed input."""
    import pyb

    port = pyb.USB_VCP()
    os.dupterm(None, 1)
    request = PromptRequest()
    byte = bytearray(1)
    while True:
        came = port.readinto(byte, 1)
        if request.comes(byte[0] if came else -1, time.ticks_ms()):
            break
        if not came:
            time.sleep_ms(1)
    os.dupterm(port, 1)
