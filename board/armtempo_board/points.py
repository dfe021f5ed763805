"""One polynomial piece of a spline as six Bezier points, each an exact number in two words.

A number of the motion record, V = high * 2**28 + low with 0 <= low < 2**28, is kept as ``high + BIAS`` and
``low``: both positive and below 2**30, so that the 31-bit integers of the chip, the 32-bit and the 64-bit
words of compiled code and CPython all mean the same. Every operation here is a weighted mean, so the bias
stays what it is. For angles ``high`` is whole steps; for times it counts 4096 ticks.

A piece is array('i') of 12: six high words, then six low words. Cubic pieces are raised to degree 5 when
they are loaded; all that follows knows quintics only.
"""

import micropython
from micropython import const

TYPE_CHECKING = False
if TYPE_CHECKING:
    from array import array

BIAS = 1 << 28
LOW_BITS = 28
_BIAS = const(1 << 28)
_LOW = const((1 << 28) - 1)
_HALF_LOW = const((1 << 14) - 1)
_WEIGHTS: "dict[int, bytes]" = {}


def weights(degree: int) -> bytes:
    """What ``combine`` takes for control points of a spline of this degree; made once."""
    if degree not in _WEIGHTS:
        from armtempo_board.weights import table  # here, so that it can be forgotten

        _WEIGHTS[degree] = table(degree)
    return _WEIGHTS[degree]


@micropython.viper
def load(data: ptr8, offset: int, count: int, raw: ptr32) -> object:
    """Read ``count`` <= 6 control points (int64, little endian) at byte ``offset`` into ``raw``."""
    i = 0
    while i < count:
        middle = int(data[offset + 3])
        low = int(data[offset]) | (int(data[offset + 1]) << 8) | (int(data[offset + 2]) << 16)
        high = (middle >> 4) | (int(data[offset + 4]) << 4) | (int(data[offset + 5]) << 12)
        high |= (int(data[offset + 6]) << 20) | ((int(data[offset + 7]) & 1) << 28)
        raw[i] = high ^ _BIAS
        raw[i + 6] = low | ((middle & 15) << 24)
        i += 1
        offset += 8


@micropython.viper
def combine(raw: ptr32, weights: ptr8, piece: ptr32) -> object:
    """Bezier points of the segment whose control points ``load`` read; rounded to the last bit.

    The control points may differ by 2**24 in their high words (16 million steps; 818 s).
    """
    count = int(weights[0])
    reference = raw[0]
    at = 1
    i = 0
    while i < 6:
        high = 0
        middle = 0
        low = 60
        j = 0
        while j < count:
            weight = int(weights[at])
            high += weight * (raw[j] - reference)
            middle += weight * (raw[j + 6] >> 14)
            low += weight * (raw[j + 6] & _HALF_LOW)
            at += 1
            j += 1
        middle += low >> 14
        high += middle >> 14
        whole = high // 120
        rest = ((high - whole * 120) << 14) + (middle & _HALF_LOW)
        middle = rest // 120
        rest = ((rest - middle * 120) << 14) + (low & _HALF_LOW)
        low = (middle << 14) + rest // 120
        piece[i] = reference + whole + (low >> 28)
        piece[i + 6] = low & _LOW
        i += 1


@micropython.viper
def copy(source: ptr32, piece: ptr32) -> object:
    """Copy a piece."""
    i = 0
    while i < 12:
        piece[i] = source[i]
        i += 1


@micropython.viper
def _blend(piece: ptr32, i: int, part: int, parts: int) -> object:
    """Replace point i by point i + (point i+1 - point i) * part / parts; ``parts`` <= 512."""
    high = piece[i + 1] - piece[i]
    low = piece[i + 7] - piece[i + 6]
    high += low >> 28
    low &= _LOW
    whole = high // parts
    rest = ((high - whole * parts) << 14) + (low >> 14)
    first = rest // parts
    rest = ((rest - first * parts) << 14) + (low & _HALF_LOW)
    second = rest // parts
    rest = ((rest - second * parts) << 14) // parts
    low = second * part + ((rest * part + (1 << 13)) >> 14)
    middle = first * part + (low >> 14)
    high = whole * part + (middle >> 14)
    low = piece[i + 6] + ((middle & _HALF_LOW) << 14) + (low & _HALF_LOW)
    piece[i] = piece[i] + high + (low >> 28)
    piece[i + 6] = low & _LOW


def restrict(piece: "array[int]", part: int, parts: int) -> None:
    """Keep only [part / parts, (part + 1) / parts] of a piece: de Casteljau twice."""
    for level in range(5):
        for i in range(5 - level):
            _blend(piece, i, part, parts)
    # what is left is [part/parts, 1]; of that keep the first 1 / (parts - part)
    rest = parts - part
    if rest > 1:
        reverse(piece)
        for level in range(5):
            for i in range(5 - level):
                _blend(piece, i, rest - 1, rest)
        reverse(piece)


@micropython.viper
def reverse(piece: ptr32) -> object:
    """Run through the piece backwards."""
    i = 0
    while i < 3:
        high = piece[i]
        low = piece[i + 6]
        piece[i] = piece[5 - i]
        piece[i + 6] = piece[11 - i]
        piece[5 - i] = high
        piece[11 - i] = low
        i += 1


@micropython.viper
def descend(root: ptr32, piece: ptr32, level: int, index: int) -> object:
    """Piece ``index`` of the 2**level equal parts of ``root``: halved ``level`` times by de Casteljau."""
    i = 0
    while i < 12:
        piece[i] = root[i]
        i += 1
    while level > 0:
        level -= 1
        right = (index >> level) & 1
        n = 5
        while n > 0:
            i = 0 if right else 5
            step = 1 if right else -1
            high = piece[i]
            low = piece[i + 6]
            k = 0
            while k < n:
                next_high = piece[i + step]
                next_low = piece[i + step + 6]
                low += next_low + 1
                high += next_high + (low >> 28)
                piece[i + 6] = ((low & _LOW) >> 1) | ((high & 1) << 27)
                piece[i] = high >> 1
                high = next_high
                low = next_low
                i += step
                k += 1
            n -= 1
