"""Whether MicroPython's prompt is asked for: a Ctrl-C (of mpremote, or typed twice) that is no noise, in no frame."""

import os
import time

from micropython import const

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

_QUIET_MS = const(50)
_CTRL_C = const(3)
_CONTROLS = b"\r\x03"
_FIRST = const(0)


class PromptRequest:
    """Looks at the bytes outside of frames; ``clear`` it at each good frame."""

    def __init__(self) -> None:
        self._controls = 0  # CR and Ctrl-C since the last good frame; -1: other bytes among them
        self._interrupt = False  # whether one of them was Ctrl-C
        self._control_ms = 0

    def clear(self) -> None:
        """A frame has come."""
        self._controls = 0
        self._interrupt = False

    def comes(self, byte: int, now_ms: "Any") -> bool:
        """Whether the prompt is asked for. ``byte``: one that came; -1: none did.

        After quiet only CR and Ctrl-C came; three in a row count at once, also right after a frame. mpremote sends
        Ctrl-A after them, once, and the prompt is to get it.
        """
        quiet = time.ticks_diff(now_ms, self._control_ms) >= _QUIET_MS
        if byte < 0:
            needed = 2 if quiet else 3
        else:
            needed = 3
            self._control_ms = now_ms
            self._count(byte, quiet)
        if self._controls >= needed and self._interrupt:
            self._controls = -1  # told once; one that comes while something moves is not kept
            return True
        return False

    def _count(self, byte: int, quiet: bool) -> None:
        if byte not in _CONTROLS:
            self._controls = -1
        elif self._controls > 0 or quiet:
            self._controls = max(0, self._controls) + 1
            self._interrupt = self._interrupt or byte == _CTRL_C


def wait() -> None:
    """Wait until somebody asks for the prompt: there, what is in a host's frames would be acted on as what is typed."""
    import pyb

    port = pyb.USB_VCP()
    os.dupterm(None, 1)
    request = PromptRequest()
    byte = bytearray(1)
    while True:
        came = port.readinto(byte, 1)
        if request.comes(byte[_FIRST] if came else -1, time.ticks_ms()):
            break
        if not came:
            time.sleep_ms(1)
    os.dupterm(port, 1)
