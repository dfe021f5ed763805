"""A cell: a piece short and straight enough to be solved in single words.

``localise`` measures a piece in a block scale of its own; ``powers`` makes the local polynomial of a cell.
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
def localise(piece: ptr32, local: ptr32) -> object:
    """Measure a piece: differences of its points in units that fill 28 bits, and the hull's positions."""
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
        return  # type: ignore[return-value]
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


@micropython.viper
def powers(local: ptr32, cell: ptr32, at: int, falling: int) -> object:
    """Polynomial of a cell over w in [0, 1]: five power coefficients, then five of a fifth of its derivative.

    Written at ``cell[at]`` with a bias of 2**30; ``falling`` mirrors it. As the differences of a cell are within
    a factor of two, no coefficient exceeds four times the range, below 2**30.
    """
    bias = 1 << 29
    sign = 1
    if falling:
        sign = -1
    a = (local[1] - bias) * sign
    b = (local[2] - bias) * sign
    c = (local[3] - bias) * sign
    d = (local[4] - bias) * sign
    e = (local[5] - bias) * sign
    bias += bias
    e += 6 * c - 4 * d - 4 * b + a
    d += 3 * b - 3 * c - a
    c += a - 2 * b
    b -= a
    cell[at] = 5 * a + bias
    cell[at + 1] = 10 * b + bias
    cell[at + 2] = 10 * c + bias
    cell[at + 3] = 5 * d + bias
    cell[at + 4] = e + bias
    cell[at + 5] = a + bias
    cell[at + 6] = 4 * b + bias
    cell[at + 7] = 6 * c + bias
    cell[at + 8] = 4 * d + bias
    cell[at + 9] = e + bias
