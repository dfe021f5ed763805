"""The control points of one spline of a stored motion, read from its file in pieces as the walk comes to them.

So a motion takes the same memory whatever its size. Reading allocates nothing; only the flash is read, never written.
"""

import micropython
from micropython import const

from armtempo_board.memory import bytes_of

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

_KEPT = const(5)  # points of the piece before: as many as a quintic segment shares with the next
_FRESH = const(5)  # points read at once
WINDOW_WORDS = const(20)
"""Words of a window: two a point."""
_FRESH_AT = const(10)  # word


# what is certain of some points
RISING = const(1)  # each is greater than the one before
EQUAL = const(2)
BOUNDED = const(4)  # by ``bound``, and their differences by 2**24

_LOWER = const(0)  # words of a point
_UPPER = const(1)
_TOP_MASK = const(255)
_HIGH_MASK = const((1 << 25) - 1)
_LOW_MASK = const((1 << 28) - 1)
_BIAS = const(1 << 28)
_MOST_SPAN = const((1 << 24) - 1)


@micropython.viper
def survey(words: ptr32, at: int, count: int, bound: int) -> int:
    """What is certain of ``count`` points from the word ``at`` on: bits. What is not may be nearly so.

    ``bound``: of their magnitudes, below 2**28; all in units of 2**28 (``bezier.HIGH``).
    """
    point = ptr32(int(words) + 4 * at)
    found = RISING | EQUAL
    least = most = high_before = low_before = i = 0
    while i < count:
        top = (point[_UPPER] >> 24) & _TOP_MASK  # both signs, also where words have 64 bits
        if top and top != _TOP_MASK:
            return 0
        low = point[_LOWER]
        high = (((point[_UPPER] & _HIGH_MASK) << 4) | ((low >> 28) & 15)) ^ _BIAS
        low &= _LOW_MASK
        if not i:
            least = most = high
        elif high != high_before or low != low_before:
            found &= RISING
            if high < high_before or (high == high_before and low < low_before):
                found = 0
        else:
            found &= EQUAL
        if high < least:
            least = high
        if high > most:
            most = high
        high_before = high
        low_before = low
        point = ptr32(int(point) + 8)
        i += 1
    if most - least < _MOST_SPAN and most - _BIAS < bound - 1 and _BIAS - least < bound:
        found |= BOUNDED
    return found


@micropython.viper
def _keep_last(words: ptr32) -> object:
    """Move the last _KEPT points to the beginning."""
    i = 0
    while i < _FRESH_AT:
        words[i] = words[i + WINDOW_WORDS - _FRESH_AT]
        i += 1


def _too_short() -> int:
    raise OSError("the motion's file ends too early")


class ControlPoints:
    """``words``: memory of WINDOW_WORDS, in which points stand as in the record (int64, little endian)."""

    def __init__(self, words: "memoryview") -> None:
        self.words = words
        self._fresh = bytes_of(words, _FRESH_AT, WINDOW_WORDS)
        self._stream: "Any" = None
        self._end = 0
        self._degree = 0

    def open(self, stream: "Any", degree: int) -> None:
        """Begin before the first segment; ``stream`` is read from its position, and closed by ``close``."""
        self.close()
        self._stream = stream
        self._end = 0  # points read so far
        self._degree = degree

    def close(self) -> None:
        """Close the file."""
        if self._stream:
            self._stream.close()
            self._stream = None

    def seek(self, segment: int) -> int:
        """Word at which the control points of a segment begin; segments are asked for in their order."""
        while segment + self._degree >= self._end:
            _keep_last(self.words)
            self._end += _FRESH if self._stream.readinto(self._fresh) else _too_short()
        return 2 * (segment - self._end + _KEPT + _FRESH)
