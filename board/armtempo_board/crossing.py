"""Where a cell crosses a threshold: Newton on the local polynomials.

A cell is array('i') of 20: what ``cell.powers`` wrote for the angle, then for the time.
A node is array('i'): w in 2**-30 of the cell, time in local units, and the two derivatives there (fifths).
"""

import micropython
from micropython import const

W = 0
TIME = 1
ANGLE_RATE = 2
TIME_RATE = 3
MANTISSA = 4  # ticks per step = MANTISSA / 2**EXPONENT; MANTISSA has 30 bits
EXPONENT = 5
DELAY = 6  # while braking: whole ticks to be added to the time, and the rate of time
RATE = 7
NODE_SIZE = 8
_HALF = const(1 << 14)
_LOW = const((1 << 15) - 1)


@micropython.viper
def solve(cell: ptr32, node: ptr32, target: int):
    """Set ``node`` to where the (rising) angle equals ``target``; Newton starts at the node's own w.

    Each round leaves at most the square of the relative error; the last one starts below 2**-14. Products are
    made of 15-bit halves: nothing exceeds 31 bits.
    """
    bias = 1 << 29
    bias += bias
    w = node[0]
    rounds = 0
    while rounds < 12:
        wh = w >> 15
        wl = w & _LOW
        angle = cell[4] - bias
        rate = cell[9] - bias
        i = 3
        while i >= 0:
            h = angle >> 15
            angle = h * wh + (((angle & _LOW) * wh + _HALF) >> 15) + ((h * wl) >> 15) + cell[i] - bias
            h = rate >> 15
            rate = h * wh + (((rate & _LOW) * wh) >> 15) + ((h * wl) >> 15) + cell[i + 5] - bias
            i -= 1
        h = angle >> 15
        angle = h * wh + (((angle & _LOW) * wh + _HALF) >> 15) + ((h * wl) >> 15)
        rest = target - angle
        slope = rate * 5
        while slope < (1 << 27):
            slope <<= 1
            rest <<= 1
        rounds += 1
        h = slope >> 14
        if rest < h and rest > 0 - h:
            rounds = 12
            w += ((rest << 12) // (slope >> 15)) << 3
        else:
            w += (rest // (slope >> 15)) << 15
        if w < 0:
            w = 0
        if w >= bias:
            w = bias - 1  # still a small integer
    wh = w >> 15
    wl = w & _LOW
    rate = cell[9] - bias
    time = cell[14] - bias
    rest = cell[19] - bias
    i = 3
    while i >= 0:
        h = rate >> 15
        rate = h * wh + (((rate & _LOW) * wh) >> 15) + ((h * wl) >> 15) + cell[i + 5] - bias
        h = time >> 15
        time = h * wh + (((time & _LOW) * wh + _HALF) >> 15) + ((h * wl) >> 15) + cell[i + 10] - bias
        h = rest >> 15
        rest = h * wh + (((rest & _LOW) * wh) >> 15) + ((h * wl) >> 15) + cell[i + 15] - bias
        i -= 1
    h = time >> 15
    node[0] = w
    node[1] = h * wh + (((time & _LOW) * wh + _HALF) >> 15) + ((h * wl) >> 15)
    node[2] = rate
    node[3] = rest


@micropython.viper
def slope(node: ptr32, exponent: int):
    """Ticks per step at a node, MANTISSA / 2**EXPONENT; ``exponent``: of one time unit per angle unit.

    Long division with 15-bit digits: relative error below 2**-28.
    """
    time = node[3]
    angle = node[2]
    while angle < (1 << 29):
        angle <<= 1
        exponent -= 1
    while time < (1 << 29):
        time <<= 1
        exponent += 1
    if time >= angle:
        time >>= 1
        exponent -= 1
    digit = angle >> 15
    first = time // digit
    rest = ((time - first * digit) << 15) - first * (angle & _LOW)
    node[4] = (first << 15) + rest // digit
    node[5] = exponent + 30
