"""The four LEDs: green idle, blue moving, orange position unknown or not configured, red fault."""

from pyb import Pin

from armtempo_board.hardware import pins

_GREEN, _ORANGE, _RED, _BLUE = 0, 1, 2, 3
_LED_OF_STATE = bytes((_ORANGE, _ORANGE, _GREEN, _BLUE, _BLUE, _RED))
"""By the state's number: unconfigured, unhomed, idle, moving, braking, fault (``messages.STATES``)."""


class Leds:
    """Lights the LED of the state; writes to the pins only if the state has changed."""

    def __init__(self) -> None:
        self._pins = [Pin(name, Pin.OUT_PP) for name in pins.LEDS]
        self._state = -1
        self.show(0)

    def show(self, state: int) -> None:
        """``state``: its number."""
        if state != self._state:
            self._state = state
            for led in range(len(self._pins)):
                self._pins[led].value(led == _LED_OF_STATE[state])
