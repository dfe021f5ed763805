"""The replay button (or a high level on its pin): starts the default motion."""

import time

from micropython import const
from pyb import Pin

from armtempo_board.hardware import pins

_STEADY_MS = const(30)


class Button:
    """``pressed`` returns True once for each press that lasts long enough."""

    def __init__(self) -> None:
        self._pin = Pin(pins.BUTTON, Pin.IN, Pin.PULL_DOWN)
        self._high = True  # a level that is high at the start is not a press
        self._changed_ms = time.ticks_ms()

    def held(self) -> bool:
        """Whether the button is down."""
        return bool(self._pin.value())

    def pressed(self) -> bool:
        """Whether the button has been pressed, debounced; True once per press."""
        now_ms = time.ticks_ms()
        if self.held() == self._high:
            self._changed_ms = now_ms
        elif time.ticks_diff(now_ms, self._changed_ms) >= _STEADY_MS:
            self._high = not self._high
            return self._high
        return False
