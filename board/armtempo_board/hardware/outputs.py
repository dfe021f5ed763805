"""The arm's outputs: pins that are on or off, and pulse widths of timers that the engine leaves free.

A value is 0 to 65535 for the whole range of an output. Setting one allocates nothing, so a motion may run. What makes
them is apart, in ``app/output_setup.py``: only this stays in memory.
"""

from array import array

from micropython import const

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

# in the numbers of an output
_LOW = const(0)
_HIGH = const(1)
_SAFE = const(2)
_NUMBERS = const(3)
_FULL = const(16383)  # 14 bits of a value: times 16 bits of a pulse width, that is a small integer
_HALF = const(8191)


class Outputs:
    """``numbers``: of each output the level or pulse width at values 0 and 65535, and its safe value."""

    def __init__(self, numbers: "array[int]") -> None:
        self.values = array("H", bytes(len(numbers) // _NUMBERS * 2))
        self.writes: "list[Callable[[int], Any]]" = []  # what takes the level or pulse width of each
        self.held: "list[Any]" = []  # their pins and timers
        self._numbers = numbers
        self._is_safe = False

    def set(self, number: int, value: int) -> None:
        """Output ``number`` (from 0) takes a value, 0 to 65535."""
        numbers = self._numbers
        at = _NUMBERS * number
        low = numbers[at + _LOW]
        self._is_safe = False
        self.values[number] = value
        self.writes[number](low + ((numbers[at + _HIGH] - low) * (value >> 2) + _HALF) // _FULL)

    def safe(self) -> None:
        """All take their safe values; costs next to nothing if they have them."""
        if not self._is_safe:
            for number in range(len(self.writes)):
                self.set(number, self._numbers[_NUMBERS * number + _SAFE])
            self._is_safe = True
