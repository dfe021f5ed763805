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

BIAS = 1 << 28
LOW_BITS = 28
_BIAS = const(1 << 28)
_LOW = const((1 << 28) - 1)
_HALF_LOW = const((1 << 14) - 1)
_QUARTER = const((1 << 25) - 1)
_WEIGHTS: "dict[int, bytes]" = {}


def weights(degree: int) -> bytes:
    """What ``combine`` takes for control points of a spline of this degree; made once."""
    if degree not in _WEIGHTS:
        from armtempo_board.stepgen.bezier_weights import table  # here, so that it can be forgotten

        _WEIGHTS[degree] = table(degree)
    return _WEIGHTS[degree]


@micropython.viper
def load(data: ptr32, offset: int, weights: ptr8, piece: ptr32) -> object:
    """Bezier points of the segment whose control points (int64, little endian) begin at word ``offset``.

    Rounded to the last bit. The control points may differ by 2**24 in their high words (16 million steps; 818 s).
    Twelve words behind the piece are overwritten.
    """
    points = ptr32(int(piece) + 48)
    here = points
    i = int(weights[0])
    while i:
        i -= 1
        low = data[offset]
        here[0] = (((data[offset + 1] & _QUARTER) << 4) | ((low >> 28) & 15)) ^ _BIAS
        here[6] = low & _LOW
        here = ptr32(int(here) + 4)
        offset += 2
    first = piece[12]
    offset = 1
    i = 6
    while i:
        i -= 1
        high = 0
        middle = 0
        low = 60
        here = points
        j = int(weights[0])
        while j:
            j -= 1
            weight = int(weights[offset])
            high += (here[0] - first) * weight
            rest = here[6]
            middle += (rest >> 14) * weight
            low += (rest & _HALF_LOW) * weight
            offset += 1
            here = ptr32(int(here) + 4)
        middle += low >> 14
        high += middle >> 14
        rest = ((high % 120) << 14) + (middle & _HALF_LOW)
        low = ((rest % 120) << 14) + (low & _HALF_LOW)
        low = ((rest // 120) << 14) + low // 120
        piece[0] = (low >> 28) + high // 120 + first
        piece[6] = low & _LOW
        piece = ptr32(int(piece) + 4)


@micropython.viper
def restrict(piece: ptr32, part: int, parts: int) -> object:
    """Keep only [part / parts, (part + 1) / parts] of a piece, ``parts`` <= 512: de Casteljau twice.

    It becomes the root of what is halved (see cell.py).
    """
    step = 4
    while parts > 1:
        left = 5
        while left:
            here = piece
            if step < 0:
                here = ptr32(int(piece) + 20)
            k = left
            while k:
                # a point becomes itself + (the one beside it - itself) * part / parts
                beside = ptr32(int(here) + step)
                low = beside[6] - here[6]
                high = (low >> 28) + beside[0] - here[0]
                low &= _LOW
                middle = ((high % parts) << 14) + (low >> 14)
                low = ((middle % parts) << 14) + (low & _HALF_LOW)
                rest = ((low % parts) << 14) // parts
                low = ((rest * part + (1 << 13)) >> 14) + low // parts * part
                middle = (low >> 14) + middle // parts * part
                low = ((middle & _HALF_LOW) << 14) + (low & _HALF_LOW) + here[6]
                here[0] = (middle >> 14) + high // parts * part + (low >> 28) + here[0]
                here[6] = low & _LOW
                here = beside
                k -= 1
            left -= 1
        # what is left is [part / parts, 1]; of that keep the first 1 / (parts - part)
        parts -= part
        part = parts - 1
        step = -4
    i = 0
    while i < 12:
        piece[i + 65] = piece[i]
        i += 1
