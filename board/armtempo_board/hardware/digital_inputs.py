"""The arm's inputs, debounced. Reading them allocates nothing."""

import time

from micropython import const

TYPE_CHECKING = False
if TYPE_CHECKING:
    from array import array

    from pyb import Pin

# in the numbers of an input
_ACTIVE = const(0)
_DEBOUNCE_MS = const(1)
_CHANGED_MS = const(2)
_NUMBERS = const(3)


class DigitalInputs:
    """``numbers``: for each pin its active level, its debounce time, and a word for the time of its last change."""

    def __init__(self, pins: "list[Pin]", numbers: "array[int]") -> None:
        self.levels = 0
        """One bit per input, set if it is active."""
        self.count = len(pins)
        self._pins = pins
        self._numbers = numbers

    def level(self, number: int) -> int:
        """1 if input ``number`` (from 0) is active, debounced."""
        return self.levels >> number & 1

    def poll(self, now_ms: int) -> None:
        """Read the pins; call it every few milliseconds."""
        numbers = self._numbers
        at = 0
        for number in range(len(self._pins)):
            is_active = self._pins[number].value() == numbers[at + _ACTIVE]
            if is_active == (self.levels >> number & 1):
                numbers[at + _CHANGED_MS] = now_ms
            elif time.ticks_diff(now_ms, numbers[at + _CHANGED_MS]) >= numbers[at + _DEBOUNCE_MS]:
                self.levels ^= 1 << number
            at += _NUMBERS
