"""One polynomial piece of a spline as the six Bezier points of degree 5, each an exact number in two words.

A number of the motion record, V = high * 2**28 + low with 0 <= low < 2**28, is kept as ``high + BIAS`` and ``low``.
Both are positive and below 2**30, so they mean the same in the 31-bit integers of the chip, in the 32-bit and 64-bit
words of compiled code, and on CPython. Every operation here is a weighted mean, which leaves the bias unchanged. Of an
angle, ``high`` counts whole steps; of a time, 4096 ticks.

A piece is array('i') of 12: six high words, then six low words. Cubic pieces are raised to degree 5 when they are
loaded, so the rest of the program knows quintics only.
"""

import micropython
from micropython import const

from armtempo_board.stepgen.bezier_weights import table

BIAS = 1 << 28
LOW_BITS = 28

# words of a piece: the first point, the last; a pointer to any point finds its two words at HIGH and LOW
HIGH = const(0)
LOW = const(6)
LAST_HIGH = const(5)
LAST_LOW = const(11)
WORDS = const(12)

_POINTS = const(6)
_LAST = const(5)  # its number
_ROOT = const(65)  # where ``restrict`` leaves a copy: the root of ``subdivision``
_BIAS = const(1 << 28)
_LOW_MASK = const((1 << 28) - 1)
_HALF_MASK = const((1 << 14) - 1)  # low words are divided in two halves, so that products fit
_QUARTER_MASK = const((1 << 25) - 1)
_DIVISOR = const(120)  # weights are times 120
_COUNT = const(0)  # in the weights: number of control points, then the weights
_FIRST_WEIGHT = const(1)
_NEXT = const(1)  # the second word of an int64
_WEIGHTS: "dict[int, bytes]" = {}


def weights(degree: int) -> bytes:
    """What ``from_control_points`` takes for a spline of this degree; made once."""
    if degree not in _WEIGHTS:
        _WEIGHTS[degree] = table(degree)
    return _WEIGHTS[degree]


@micropython.viper
def from_control_points(data: ptr32, offset: int, weights: ptr8, piece: ptr32) -> object:
    """Bezier points of the segment whose control points (int64, little endian) begin at word ``offset`` of the record.

    Rounded to the nearest unit. The high words of the control points may differ by 2**24 (16 million steps; 818 s).
    The twelve words after the piece are overwritten.
    """
    # Split the control points into high and low words, after the piece
    points = ptr32(int(piece) + 4 * WORDS)
    point = points
    i = int(weights[_COUNT])
    while i:
        i -= 1
        low = data[offset]
        point[HIGH] = (((data[offset + _NEXT] & _QUARTER_MASK) << 4) | ((low >> 28) & 15)) ^ _BIAS
        point[LOW] = low & _LOW_MASK
        point = ptr32(int(point) + 4)
        offset += 2
    # Each Bezier point is their weighted mean; high words are taken from the first one, so that sums stay small
    first = piece[WORDS]
    offset = _FIRST_WEIGHT
    i = _POINTS
    while i:
        i -= 1
        high = 0
        middle = 0
        low = 60
        point = points
        j = int(weights[_COUNT])
        while j:
            j -= 1
            weight = int(weights[offset])
            high += (point[HIGH] - first) * weight
            rest = point[LOW]
            middle += (rest >> 14) * weight
            low += (rest & _HALF_MASK) * weight
            offset += 1
            point = ptr32(int(point) + 4)
        # Divide by 120: a long division in three digits
        middle += low >> 14
        high += middle >> 14
        rest = ((high % _DIVISOR) << 14) + (middle & _HALF_MASK)
        low = ((rest % _DIVISOR) << 14) + (low & _HALF_MASK)
        low = ((rest // _DIVISOR) << 14) + low // _DIVISOR
        piece[HIGH] = (low >> 28) + high // _DIVISOR + first
        piece[LOW] = low & _LOW_MASK
        piece = ptr32(int(piece) + 4)


@micropython.viper
def restrict(piece: ptr32, part: int, parts: int) -> object:
    """Keep only [part / parts, (part + 1) / parts] of a piece, ``parts`` <= 512, by de Casteljau's algorithm.

    A copy is left in the place of the root, from which ``subdivision`` halves.
    """
    # Twice: the first pass leaves [part / parts, 1], the second keeps the first 1 / (parts - part) of that
    step = 4
    while parts > 1:
        left = _LAST
        while left:
            point = piece
            if step < 0:
                point = ptr32(int(piece) + 4 * _LAST)
            k = left
            while k:
                # A point becomes itself + (its neighbour - itself) * part / parts
                neighbour = ptr32(int(point) + step)
                low = neighbour[LOW] - point[LOW]
                high = (low >> 28) + neighbour[HIGH] - point[HIGH]
                low &= _LOW_MASK
                middle = ((high % parts) << 14) + (low >> 14)
                low = ((middle % parts) << 14) + (low & _HALF_MASK)
                rest = ((low % parts) << 14) // parts
                low = ((rest * part + (1 << 13)) >> 14) + low // parts * part
                middle = (low >> 14) + middle // parts * part
                low = ((middle & _HALF_MASK) << 14) + (low & _HALF_MASK) + point[LOW]
                point[HIGH] = (middle >> 14) + high // parts * part + (low >> 28) + point[HIGH]
                point[LOW] = low & _LOW_MASK
                point = neighbour
                k -= 1
            left -= 1
        parts -= part
        part = parts - 1
        step = -4
    i = 0
    while i < WORDS:
        piece[i + _ROOT] = piece[i]
        i += 1
