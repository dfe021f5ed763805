"""Where a cell passes its thresholds: Newton on the local polynomials.

What belongs to a cell stands in one block, array('i'): the polynomials of the angle (10 words) and of the time
(10 words), the words named here, and nodes. A node is where one of the cell's steps is.
"""

import micropython
from micropython import const

# block
TARGET = 20  # the first threshold in local angle units, + 2**29
SCALE = 21  # fraction bits of local angle units
RANGE = 22  # angle at the cell's end; 0: all steps come at its start
OFFSET = 23  # what is added to each node's time
EXPONENT_OFFSET = 24  # fraction bits of time less those of angle, + 64
LAST_W = 25  # of the node solved last, from where the next is guessed: w in 2**-30 of the cell,
LAST_RATE = 26  # a fifth of the angle's derivative,
LAST_ANGLE = 27  # angle
A = 28  # nodes: the one reached last, and two ahead of it
MIDDLE = 36
B = 44
HELD = 52  # the step held back, only while it is moved by braking
LAW = 60  # the law of braking, see braking.py
BLOCK_SIZE = 64

# node
TIME = 0  # ticks * 2**(scale of the cell's time), counted from the high word at the cell's start
MANTISSA = 1  # ticks per step = MANTISSA / 2**EXPONENT; MANTISSA has 29 or 30 bits
EXPONENT = 2
DELAY = 3  # while braking: whole ticks to be added to the time,
RATE = 4  # and the rate of the motion's time

_BIAS = const(1 << 29)
_HALF = const(1 << 14)
_LOW = const((1 << 15) - 1)


@micropython.viper
def enter(cell: ptr32, angle: ptr32, angle_local: ptr32, time_local: ptr32) -> object:
    """Take up a cell: its polynomials over w in [0, 1], mirrored where it falls, and its first threshold.

    Each is five power coefficients, then five of a fifth of its derivative, with a bias of 2**30. As the differences
    are within a factor of two, none exceeds four times the range, below 2**30. ``cell[TARGET]`` holds twice the
    threshold, from the high word of the first point, with a bias of 2**28.
    """
    scale = angle_local[0]
    sign = 1
    if angle_local[1] < _BIAS:
        sign = -1
    cell[20] = (((cell[20] - (1 << 28)) << (scale - 1)) - (angle[6] >> (28 - scale))) * sign + _BIAS
    cell[21] = scale
    cell[24] = time_local[0] - 12 - scale + 64
    local = angle_local
    passes = 2
    while passes:
        bias = 1 << 29
        a = (local[1] - bias) * sign
        b = (local[2] - bias) * sign
        c = (local[3] - bias) * sign
        d = (local[4] - bias) * sign
        e = (local[5] - bias) * sign
        bias += bias
        if passes > 1:
            cell[22] = a + b + c + d + e
            cell[25] = 0
            cell[26] = a
            cell[27] = 0
        e += 6 * c - 4 * d - 4 * b + a
        d += 3 * b - 3 * c - a
        c += a - 2 * b
        b -= a
        cell[0] = 5 * a + bias
        cell[1] = 10 * b + bias
        cell[2] = 10 * c + bias
        cell[3] = 5 * d + bias
        cell[4] = e + bias
        cell[5] = a + bias
        cell[6] = 4 * b + bias
        cell[7] = 6 * c + bias
        cell[8] = 4 * d + bias
        cell[9] = e + bias
        cell = ptr32(int(cell) + 40)
        passes -= 1
        sign = 1
        local = time_local


@micropython.viper
def solve(cell: ptr32, h: int, length: int) -> object:
    """Set node A to the cell's step ``h``, or MIDDLE and B to those ``length`` and twice ``length`` behind it.

    Each Newton step leaves at most the square of the relative error; the last one starts below 2**-14, from a
    residual that was evaluated, so errors do not add up from one step to the next. Products
    are made of 15-bit halves: nothing exceeds 31 bits. The slope is a long division with 15-bit digits,
    its relative error below 2**-28.

    The compiler keeps the first two arguments in registers: ``h`` becomes the high half of what is multiplied.
    """
    index = h
    last = 1
    node = ptr32(int(cell) + 112)
    if length:
        last = 0
        node = ptr32(int(cell) + 144)
    while True:
        index += length
        bias = 1 << 29
        target = cell[20] - bias + (index << cell[21])
        bias += bias
        if not cell[22]:
            cell[28] = cell[23]
            return  # type: ignore[return-value]
        if target < 0:
            target = 0
        if target > cell[22]:
            target = cell[22]
        w = cell[25]
        rate = cell[26]
        rest = target - cell[27]
        rounds = 0
        while True:
            if rate < 1:  # rounding, where a cell is a few units high
                rate = 1
            slope = rate * 5
            while slope < (1 << 27):
                slope <<= 1
                rest <<= 1
            h = slope >> 14
            if rounds and rest < h and rest > 0 - h:
                rounds = 13
                w += ((rest << 12) // (slope >> 15)) << 3
            else:
                w += (rest // (slope >> 15)) << 15
            if w < 0:
                w = 0
            if w >= bias:
                w = bias - 1
            wh = w >> 15
            wl = w & _LOW
            rounds += 1
            if rounds > 12:
                break
            here = ptr32(int(cell) + 16)
            rest = here[0] - bias
            rate = here[5] - bias
            i = 4
            while i:
                i -= 1
                here = ptr32(int(here) - 4)
                h = rest >> 15
                rest = h * wh + (((rest & _LOW) * wh + _HALF) >> 15) + ((h * wl) >> 15) + here[0] - bias
                h = rate >> 15
                rate = h * wh + (((rate & _LOW) * wh) >> 15) + ((h * wl) >> 15) + here[5] - bias
            h = rest >> 15
            rest = target - h * wh - (((rest & _LOW) * wh + _HALF) >> 15) - ((h * wl) >> 15)
        here = ptr32(int(cell) + 16)
        rate = here[5] - bias
        time = here[10] - bias
        slope = here[15] - bias
        i = 4
        while i:
            i -= 1
            here = ptr32(int(here) - 4)
            h = rate >> 15
            rate = h * wh + (((rate & _LOW) * wh) >> 15) + ((h * wl) >> 15) + here[5] - bias
            h = time >> 15
            time = h * wh + (((time & _LOW) * wh + _HALF) >> 15) + ((h * wl) >> 15) + here[10] - bias
            h = slope >> 15
            slope = h * wh + (((slope & _LOW) * wh) >> 15) + ((h * wl) >> 15) + here[15] - bias
        h = time >> 15
        node[0] = h * wh + (((time & _LOW) * wh + _HALF) >> 15) + ((h * wl) >> 15) + cell[23]
        cell[25] = w
        cell[26] = rate
        cell[27] = target
        # slope of time over angle
        if rate < 1:
            rate = 1
        if slope < 1:
            slope = 1
        i = cell[24] - 34
        while rate < (1 << 29):
            rate <<= 1
            i -= 1
        while slope < (1 << 29):
            slope <<= 1
            i += 1
        if slope >= rate:
            slope >>= 1
            i -= 1
        h = rate >> 15
        wh = slope // h
        rest = ((slope - wh * h) << 15) - wh * (rate & _LOW)
        rest = (wh << 15) + rest // h
        node[1] = rest if rest < bias else bias - 1  # still a small integer
        node[2] = i if i > 0 else 0  # slower than that no stretch is made
        if last:
            break
        last = 1
        node = ptr32(int(node) + 32)
