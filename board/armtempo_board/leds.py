"""The four LEDs: green idle, blue moving, orange position unknown or not configured, red fault."""

from armtempo_shared.messages import STATES
from pyb import Pin

from armtempo_board import pins

_GREEN, _ORANGE, _RED, _BLUE = range(4)
_LED_OF_STATE = {
    "unconfigured": _ORANGE,
    "unhomed": _ORANGE,
    "idle": _GREEN,
    "moving": _BLUE,
    "braking": _BLUE,
    "fault": _RED,
}


class Leds:
    """Lights the LED of the state; touches the pins only where the state has changed."""

    def __init__(self) -> None:
        self._pins = [Pin(name, Pin.OUT_PP) for name in pins.LEDS]
        self._led_of_state = [_LED_OF_STATE[name] for name in STATES]
        self._state = -1
        self.show(0)

    def show(self, state: int) -> None:
        """``state`` is an index into STATES."""
        if state != self._state:
            self._state = state
            for led in range(len(self._pins)):
                self._pins[led].value(led == self._led_of_state[state])
