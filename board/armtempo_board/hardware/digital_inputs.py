"""The arm's inputs: levels that have been steady for their debounce time. Reading them allocates nothing."""

import time
from array import array

from pyb import Pin


class DigitalInputs:
    """``rows`` of the arm record (``armrecord.INPUT``)."""

    def __init__(self, rows: "list[dict[str, int]]") -> None:
        self.count = len(rows)
        self._pins = [_input(row) for row in rows]
        self._active = bytes([row["active_high"] for row in rows])
        self._debounce_ms = array("H", [row["debounce_ms"] for row in rows])
        self._changed_ms = array("I", [0] * len(rows))
        self.levels = 0
        for number in range(len(rows)):
            self.levels |= self._is_active(number) << number

    def _is_active(self, number: int) -> int:
        return 1 if self._pins[number].value() == self._active[number] else 0

    def level(self, number: int) -> int:
        """1 where input ``number`` (from 0) is active, debounced."""
        return self.levels >> number & 1

    def poll(self, now_ms: int) -> None:
        """Look at the pins; call it every few milliseconds. A level counts when it has been steady."""
        for number in range(len(self._pins)):
            if self._is_active(number) == self.level(number):
                self._changed_ms[number] = now_ms
            elif time.ticks_diff(now_ms, self._changed_ms[number]) >= self._debounce_ms[number]:
                self.levels ^= 1 << number


def _input(row: "dict[str, int]") -> Pin:
    from armtempo_board.hardware import pins  # here, so that it can be forgotten

    pull = Pin.PULL_DOWN if row["active_high"] else Pin.PULL_UP
    return Pin(pins.name(row["pin"]), Pin.IN, pull=pull)
