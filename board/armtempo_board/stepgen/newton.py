"""Newton's method: where a monotone subinterval passes its half steps, and the slope of time over angle there.

All that belongs to a subinterval is in one array, array('i'), the solver: the polynomials of angle and time, the
words named here, and nodes. A node is one of its steps, solved: its time, and the ticks per step at it.
"""

import micropython
from micropython import const

# words of the solver: polynomials of angle, of a fifth of its derivative, of time, of a fifth of its derivative;
# a pointer to a coefficient of the first finds those of the same power of w in the others
_ANGLE = const(0)
_ANGLE_RATE = const(5)
_TIME = const(10)
_TIME_RATE = const(15)
# their coefficients; angle and time are 0 if w is 0
_W1 = const(0)
_W2 = const(1)
_W3 = const(2)
_W4 = const(3)
_W5 = const(4)
_RATE_W0 = const(5)
_RATE_W1 = const(6)
_RATE_W2 = const(7)
_RATE_W3 = const(8)
_RATE_W4 = const(9)
_HIGHEST = const(4)
# further words
TARGET = const(20)  # the first half step in local angle units, + 2**29
ANGLE_SCALE = const(21)  # fraction bits of local angle units
RANGE = const(22)  # angle at the subinterval's end; 0: all steps come at its start
TIME_OFFSET = const(23)  # what is added to each node's time
_SLOPE_EXPONENT = const(24)  # fraction bits of time less those of angle, + 64
# the step solved last, from which the next is guessed
_LAST_W = const(25)  # w in 2**-30 of the subinterval
_LAST_RATE = const(26)  # a fifth of the angle's derivative
_LAST_ANGLE = const(27)
# nodes: the step reached last, and two ahead of it
FIRST_NODE = const(28)
MIDDLE_NODE = const(33)
END_NODE = const(38)
HELD_NODE = const(43)  # the step held back, only if the law of real time moves it
_TREND = const(48)  # half of how LAST_RATE differs from the one before, + 2**29
SOLVER_SIZE = const(49)

# words of a node; its time is ticks * 2**(scale of the subinterval's time), from the subinterval's first high word on
NODE_TIME = const(0)
NODE_MANTISSA = const(1)  # ticks per step = mantissa / 2**exponent; the mantissa has 29 or 30 bits
NODE_EXPONENT = const(2)
NODE_DELAY = const(3)  # by the law of real time: whole ticks of it next to the time,
NODE_RATE = const(4)  # and the rate of the motion's time
_NODE_WORDS = const(5)

# as in subdivision.py: measures of a piece
_SCALE = const(0)
_DIFFERENCE_1 = const(1)  # = FIRST_DIFFERENCE + 0
_DIFFERENCE_2 = const(2)  # = FIRST_DIFFERENCE + 1
_DIFFERENCE_3 = const(3)  # = FIRST_DIFFERENCE + 2
_DIFFERENCE_4 = const(4)  # = FIRST_DIFFERENCE + 3
_DIFFERENCE_5 = const(5)  # = FIRST_DIFFERENCE + 4
# as in bezier.py: word of a piece
_LOW = const(6)

_BIAS = const(1 << 29)
_HALF = const(1 << 14)  # rounds a product of 15-bit halves
_HALF_MASK = const((1 << 15) - 1)
_MOST_ROUNDS = const(12)
_LAST_ROUND = const(13)


@micropython.viper
def set_interval(solver: ptr32, angle: ptr32, angle_measures: ptr32, time_measures: ptr32) -> object:
    """Take up a subinterval: its polynomials over w in [0, 1], mirrored if the angle falls, and its first half step.

    Each is five power coefficients, then five of a fifth of its derivative, with a bias of 2**30. As the differences
    are within a factor of two, none exceeds four times the range, below 2**30. TARGET holds twice the half step,
    from the high word of the first point, with a bias of 2**28.
    """
    scale = angle_measures[_SCALE]
    sign = 1
    if angle_measures[_DIFFERENCE_1] < _BIAS:
        sign = -1
    solver[TARGET] = (
        ((solver[TARGET] - (1 << 28)) << (scale - 1)) - (angle[_LOW] >> (28 - scale))
    ) * sign + _BIAS
    solver[ANGLE_SCALE] = scale
    solver[_SLOPE_EXPONENT] = time_measures[_SCALE] - 12 - scale + 64
    measures = angle_measures
    passes = 2
    while passes:  # angle, then time
        bias = 1 << 29
        a = (measures[_DIFFERENCE_1] - bias) * sign
        b = (measures[_DIFFERENCE_2] - bias) * sign
        c = (measures[_DIFFERENCE_3] - bias) * sign
        d = (measures[_DIFFERENCE_4] - bias) * sign
        e = (measures[_DIFFERENCE_5] - bias) * sign
        bias += bias
        if passes > 1:
            solver[RANGE] = a + b + c + d + e
            solver[_LAST_W] = 0
            solver[_LAST_RATE] = a
            solver[_LAST_ANGLE] = 0
            solver[_TREND] = _BIAS
        # From Bezier to power form: differences of the differences
        e += 6 * c - 4 * d - 4 * b + a
        d += 3 * b - 3 * c - a
        c += a - 2 * b
        b -= a
        solver[_W1] = 5 * a + bias
        solver[_W2] = 10 * b + bias
        solver[_W3] = 10 * c + bias
        solver[_W4] = 5 * d + bias
        solver[_W5] = e + bias
        solver[_RATE_W0] = a + bias
        solver[_RATE_W1] = 4 * b + bias
        solver[_RATE_W2] = 6 * c + bias
        solver[_RATE_W3] = 4 * d + bias
        solver[_RATE_W4] = e + bias
        solver = ptr32(int(solver) + 4 * _TIME)
        passes -= 1
        sign = 1
        measures = time_measures


@micropython.viper
def solve(solver: ptr32, high: int, length: int) -> object:
    """Set FIRST_NODE to the subinterval's step ``high``, or, with a ``length``, MIDDLE_NODE and END_NODE to those
    ``length`` and twice ``length`` after it.

    Each Newton step leaves at most the square of the relative error; the last one starts below 2**-14, from a
    residual that was evaluated, so errors do not add up from one step to the next. Products
    are made of 15-bit halves: nothing exceeds 31 bits. The slope is a long division with 15-bit digits,
    its relative error below 2**-28.

    The compiler keeps the first two arguments in registers, so ``high`` becomes the high half of what is multiplied.
    """
    index = high
    is_last = 1
    node = ptr32(int(solver) + 4 * FIRST_NODE)
    if length:
        is_last = 0
        node = ptr32(int(solver) + 4 * MIDDLE_NODE)
    while True:
        # The half step, within the range; steps that all come at the start need no more
        index += length
        bias = 1 << 29
        target = solver[TARGET] - bias + (index << solver[ANGLE_SCALE])
        bias += bias
        if not solver[RANGE]:
            solver[FIRST_NODE] = solver[TIME_OFFSET]
            return  # type: ignore[return-value]
        if target < 0:
            target = 0
        if target > solver[RANGE]:
            target = solver[RANGE]
        # Newton: w += residual / rate, from the step solved last; first with the rate half way if it continues changing
        w = solver[_LAST_W]
        rate = solver[_LAST_RATE]
        residual = target - solver[_LAST_ANGLE]
        if residual > 0:
            rate += solver[_TREND] - _BIAS
        rounds = 0
        while True:
            if rate < 1:  # rounding, if a subinterval is a few units high
                rate = 1
            slope = rate * 5
            while slope < (1 << 27):
                slope <<= 1
                residual <<= 1
            high = slope >> 14
            if rounds and residual < high and residual > 0 - high:
                rounds = _LAST_ROUND
                w += ((residual << 12) // (slope >> 15)) << 3
            else:
                w += (residual // (slope >> 15)) << 15
            if w < 0:
                w = 0
            if w >= bias:
                w = bias - 1
            w_high = w >> 15
            w_low = w & _HALF_MASK
            rounds += 1
            if rounds > _MOST_ROUNDS:
                break
            # Horner: the residual and the rate at w
            coefficient = ptr32(int(solver) + 4 * _HIGHEST)
            residual = coefficient[_ANGLE] - bias
            rate = coefficient[_ANGLE_RATE] - bias
            i = 4
            while i:
                i -= 1
                coefficient = ptr32(int(coefficient) - 4)
                high = residual >> 15
                residual = (
                    high * w_high
                    + (((residual & _HALF_MASK) * w_high + _HALF) >> 15)
                    + ((high * w_low) >> 15)
                    + coefficient[_ANGLE]
                    - bias
                )
                high = rate >> 15
                rate = (
                    high * w_high
                    + (((rate & _HALF_MASK) * w_high) >> 15)
                    + ((high * w_low) >> 15)
                    + coefficient[_ANGLE_RATE]
                    - bias
                )
            high = residual >> 15
            residual = (
                target
                - high * w_high
                - (((residual & _HALF_MASK) * w_high + _HALF) >> 15)
                - ((high * w_low) >> 15)
            )
        # Horner: the rate of the angle, the time and its rate at the solution
        coefficient = ptr32(int(solver) + 4 * _HIGHEST)
        rate = coefficient[_ANGLE_RATE] - bias
        time = coefficient[_TIME] - bias
        slope = coefficient[_TIME_RATE] - bias
        i = 4
        while i:
            i -= 1
            coefficient = ptr32(int(coefficient) - 4)
            high = rate >> 15
            rate = (
                high * w_high
                + (((rate & _HALF_MASK) * w_high) >> 15)
                + ((high * w_low) >> 15)
                + coefficient[_ANGLE_RATE]
                - bias
            )
            high = time >> 15
            time = (
                high * w_high
                + (((time & _HALF_MASK) * w_high + _HALF) >> 15)
                + ((high * w_low) >> 15)
                + coefficient[_TIME]
                - bias
            )
            high = slope >> 15
            slope = (
                high * w_high
                + (((slope & _HALF_MASK) * w_high) >> 15)
                + ((high * w_low) >> 15)
                + coefficient[_TIME_RATE]
                - bias
            )
        high = time >> 15
        node[NODE_TIME] = (
            high * w_high
            + (((time & _HALF_MASK) * w_high + _HALF) >> 15)
            + ((high * w_low) >> 15)
            + solver[TIME_OFFSET]
        )
        solver[_LAST_W] = w
        solver[_TREND] = ((rate - solver[_LAST_RATE]) >> 1) + _BIAS
        solver[_LAST_RATE] = rate
        solver[_LAST_ANGLE] = target
        # The slope of time over angle as a floating-point number: both rates to 30 bits, then a long division
        if rate < 1:
            rate = 1
        if slope < 1:
            slope = 1
        i = solver[_SLOPE_EXPONENT] - 34
        rate <<= 2  # neither exceeds two fifths of the range
        slope <<= 2
        while rate < (1 << 29):
            rate <<= 1
            i -= 1
        while slope < (1 << 29):
            slope <<= 1
            i += 1
        if slope >= rate:
            slope >>= 1
            i -= 1
        high = rate >> 15
        w_high = slope // high
        residual = ((slope - w_high * high) << 15) - w_high * (rate & _HALF_MASK)
        residual = (w_high << 15) + residual // high
        node[NODE_MANTISSA] = residual if residual < bias else bias - 1  # still a small integer
        node[NODE_EXPONENT] = i if i > 0 else 0  # 0: so slow that steps are solved one by one
        if is_last:
            break
        is_last = 1
        node = ptr32(int(node) + 4 * _NODE_WORDS)
