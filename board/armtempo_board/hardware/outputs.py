"""The arm's outputs: pins that are on or off, and pulse widths of timers that the engine leaves free.

A value is 0 to 65535 for the whole range of an output. Setting one allocates nothing, so a motion may run.
"""

from array import array

from micropython import const
from pyb import Pin, Timer

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

_FULL = const(16383)  # 14 bits of a value: times 16 bits of a pulse width, that is a small integer
_HALF = const(8191)


class Outputs:
    """``rows`` of the arm record (``armrecord.OUTPUT``). All take their safe values."""

    def __init__(self, rows: "list[dict[str, int]]") -> None:
        from armtempo_board.hardware import pins  # here, so that it can be forgotten

        self.values = array("H", [row["safe"] for row in rows])
        self._safe = array("H", self.values)
        self._low = array("H", [row["low"] for row in rows])
        self._high = array("H", [row["high"] for row in rows])
        self._timers: "dict[int, Timer]" = {}
        self._pins = [Pin(pins.name(row["pin"])) for row in rows]
        self._write: "list[Callable[[int], Any]]" = [self._driven(n, row) for n, row in enumerate(rows)]
        self._is_safe = True

    def _driven(self, number: int, row: "dict[str, int]") -> "Callable[[int], Any]":
        """What takes the level or pulse width of an output; bound once, as that allocates."""
        pin = self._pins[number]
        level = self._level(number, row["safe"])
        if not row["timer"]:
            pin.init(Pin.OUT_PP, value=level)
            return pin.value
        timer = self._timers.get(row["timer"])
        if timer is None:
            timer = Timer(row["timer"], prescaler=row["prescaler"], period=row["period"])
            self._timers[row["timer"]] = timer
        return timer.channel(row["channel"], Timer.PWM, pin=pin, pulse_width=level).pulse_width

    def _level(self, number: int, value: int) -> int:
        low = self._low[number]
        return low + ((self._high[number] - low) * (value >> 2) + _HALF) // _FULL

    def set(self, number: int, value: int) -> None:
        """Output ``number`` (from 0) takes a value, 0 to 65535."""
        self._is_safe = False
        self.values[number] = value
        self._write[number](self._level(number, value))

    def safe(self) -> None:
        """All take their safe values; costs next to nothing where they have them."""
        if self._is_safe:
            return
        for number in range(len(self._safe)):
            self.set(number, self._safe[number])
        self._is_safe = True

    def close(self) -> None:
        """Safe values, then let go of pins and timers."""
        self.safe()
        for timer in self._timers.values():
            timer.deinit()
        for pin in self._pins:
            pin.init(Pin.IN)
