"""Measures a piece in a block scale of its own, in single words.

Signed values in arrays are stored with a bias, see points.py.
"""

import micropython
from micropython import const

# what localise() writes
SCALE = 0  # fraction bits f of the local unit, 2**-f high units; 0: the piece is too large
STEPS = 1  # five differences of neighbouring points, local units, + DIFFERENCE_BIAS
LEAST = 6  # least and largest of these
MOST = 7
LOWEST = 8  # least and largest position (high + BIAS of the points, rounded) in the hull
HIGHEST = 9
LOCAL_SIZE = 10
DIFFERENCE_BIAS = 1 << 29
_D_BIAS = const(1 << 29)


@micropython.viper
def localise(piece: ptr32, local: ptr32) -> int:
    """Measure a piece: differences of its points in units that fill 28 bits, and the hull's positions.

    Gives 1 or -1 where all differences are of that sign and within a factor of two; otherwise 0.
    """
    least = piece[0]
    most = least
    lowest = least + (piece[6] >> 27)
    highest = lowest
    i = 1
    while i < 6:
        high = piece[i]
        if high < least:
            least = high
        if high > most:
            most = high
        high += piece[i + 6] >> 27
        if high < lowest:
            lowest = high
        if high > highest:
            highest = high
        i += 1
    local[8] = lowest
    local[9] = highest
    span = most - least
    scale = 28
    while span > 0:
        span >>= 1
        scale -= 1
    if scale < 13:
        local[0] = 0
        return 0
    local[0] = scale
    first = piece[0]
    last = piece[6] >> (28 - scale)
    least = _D_BIAS
    most = 0 - _D_BIAS
    i = 1
    while i < 6:
        here = ((piece[i] - first) << scale) + (piece[i + 6] >> (28 - scale))
        high = here - last
        last = here
        local[i] = high + _D_BIAS
        if high < least:
            least = high
        if high > most:
            most = high
        i += 1
    local[6] = least + _D_BIAS
    local[7] = most + _D_BIAS
    if least > 0 and most <= 2 * least:
        return 1
    if most < 0 and least >= 2 * most:
        return -1
    return 0
