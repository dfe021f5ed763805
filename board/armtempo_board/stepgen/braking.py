"""Coming to rest along the path: real time as a function of the motion's own time.

From the start on, over a length L, the motion's time runs slower and slower: at x = (real time - start) / L its
rate is 1 - S(x), S(x) = 10 x**3 - 15 x**4 + 6 x**5. At x = 1 it stands still for good, at start + L / 2 of the motion's
time. With r = 1 - x, the way left is e(r) = r**4 (2.5 - 3 r + r**2) of L, and the rate is
e'(r) = r**3 (10 - 15 r + 6 r**2). This law moves the nodes, time and slope; all steps between them follow. Fractions
here have 30 bits.
"""

import micropython
from micropython import const

from armtempo_board.stepgen import bezier
from armtempo_board.stepgen.newton import LAW

# words of the law
LENGTH = const(0)  # 28 bits; in 2**UNIT ticks
START_HIGH = const(1)  # 4096 ticks, + bezier.BIAS
START_LOW = const(2)  # the rest of it, ticks
UNIT = const(3)

# as in newton.py: words of the solver, and of a node
_LAW = const(60)
_NODE_TIME = const(0)
_NODE_MANTISSA = const(1)
_NODE_EXPONENT = const(2)
_NODE_DELAY = const(3)
_NODE_RATE = const(4)

_HALF_MASK = const((1 << 15) - 1)
_LONGEST = const(1 << 28)
_LONGEST_TICKS = const(1 << 30)
_MOST = const((1 << 30) - 1)
_FIVE_EIGHTHS = const(5 << 27)
_LEAST_RATE = const(1 << 10)
_FAR = const(1 << 17)  # in 4096 ticks: longer than any length
_MOST_ROUNDS = const(60)


def set_law(solver: "memoryview[int]", start_ticks: int, length_ticks: int) -> None:
    """Brake from a time on over ``length_ticks`` of real time; more than 2**30 (12.8 s) counts as that."""
    length_ticks = min(length_ticks, _LONGEST_TICKS)
    unit = 0
    while length_ticks >> unit >= _LONGEST:
        unit += 1
    solver[LAW + LENGTH] = max(length_ticks >> unit, 2)
    solver[LAW + START_HIGH] = (start_ticks >> 12) + bezier.BIAS
    solver[LAW + START_LOW] = start_ticks & 4095
    solver[LAW + UNIT] = unit


def is_past(solver: "memoryview[int]", high: int) -> bool:
    """Whether a time (4096 ticks, + bezier.BIAS) lies behind the end of the way."""
    return bool(high - solver[LAW + START_HIGH] > (solver[LAW + LENGTH] >> 13) + 1 << solver[LAW + UNIT])


@micropython.viper
def to_real_time(node: ptr32, digit: int, high: int, scale: int) -> int:
    """Move the time (2**-scale ticks from ``high`` on) of a node to real time; 0: it never comes, else 1.

    ``node``: the solver; ``digit``: word at which the node begins in it. The whole ticks of delay go to NODE_DELAY, the
    rest to the time; NODE_RATE becomes that of the motion's time. The compiler keeps the first two arguments in
    registers: ``node`` becomes the node, ``digit`` the high half of a product.
    """
    law = ptr32(int(node) + 4 * _LAW)
    node = ptr32(int(node) + 4 * digit)
    one = 1 << 29
    one += one
    node[_NODE_DELAY] = 0
    node[_NODE_RATE] = one
    # Before the start nothing changes; behind the end of the way nothing comes
    unit = law[UNIT]
    high -= law[START_HIGH]
    if high < 0 - _FAR:
        return 1
    if high > _FAR:
        return 0
    ticks = (high << 12) + (node[_NODE_TIME] >> scale) - law[START_LOW]
    if ticks <= 0:
        return 1
    length = law[LENGTH]
    if (ticks >> unit) >= (length >> 1):
        return 0
    # y, the way gone: ticks / length, a long division with 15-bit digits
    way = ticks >> unit
    rest = ((ticks & ((1 << unit) - 1)) << scale) + (node[_NODE_TIME] & ((1 << scale) - 1))
    up = 0
    while length < (1 << 29):
        length <<= 1
        up += 1
    lost = unit + scale - up
    way <<= up
    if lost >= 0:
        way += rest >> lost
    else:
        way += rest << (0 - lost)
    divisor = length >> 15
    first = way // divisor
    way = ((way - first * divisor) << 15) - first * (length & _HALF_MASK)
    y = (first << 15) + way // divisor
    left = (one >> 1) - y
    if left <= 0:
        return 0
    # r of e(r) = left: Newton from above, where e is convex
    r = one - y
    rounds = 0
    rate = one
    while rounds < _MOST_ROUNDS:
        rounds += 1
        # rate = e'(r) and way = e(r) - left, from the powers of r
        digit = r >> 15
        low = r & _HALF_MASK
        square = digit * digit + ((digit * low) >> 14) + ((low * low) >> 30)
        rate = _FIVE_EIGHTHS - r + (r >> 4) + (square >> 2) + (square >> 3)
        way = _FIVE_EIGHTHS - r + (r >> 2) + (square >> 2)
        first = square >> 15
        second = square & _HALF_MASK
        cube = first * digit + ((first * low) >> 15) + ((second * digit) >> 15)
        fourth = first * first + ((first * second) >> 14)
        digit = cube >> 15
        low = cube & _HALF_MASK
        rate = (
            digit * (rate >> 15) + ((low * (rate >> 15)) >> 15) + ((digit * (rate & _HALF_MASK)) >> 15)
        ) << 4
        digit = fourth >> 15
        low = fourth & _HALF_MASK
        way = (digit * (way >> 15) + ((low * (way >> 15)) >> 15) + ((digit * (way & _HALF_MASK)) >> 15)) << 2
        way -= left
        if way <= 0 or rate < _LEAST_RATE:
            break
        # The Newton step, way / rate, with as many bits as fit
        first = rate
        up = 15
        while first < (1 << 29):
            first <<= 1
            up += 1
        while way < (1 << 28):
            way <<= 1
            up -= 1
        way = way // (first >> 15)
        if up >= 0:
            way <<= up
        else:
            way >>= 0 - up
        if way == 0:
            break
        r -= way
    if rate < _LEAST_RATE:
        return 0
    # The delay: length * (1 - r - y), in ticks and 2**-15 ticks
    way = one - r - y
    if way < 0:
        way = 0
    length = law[LENGTH]
    first = length >> 14
    second = length & ((1 << 14) - 1)
    digit = way >> 15
    low = way & _HALF_MASK
    high = first * digit
    low = ((high & 1) << 14) + ((first * low) >> 1) + second * digit + ((second * low) >> 15)
    high = ((high >> 1) + (low >> 15)) << unit
    low = (low & _HALF_MASK) << unit
    node[_NODE_DELAY] = high + (low >> 15)
    node[_NODE_RATE] = rate
    low &= _HALF_MASK
    if scale <= 15:
        node[_NODE_TIME] += low >> (15 - scale)
    else:
        node[_NODE_TIME] += low << (scale - 15)
    return 1


@micropython.viper
def scale_slope(node: ptr32, place: int) -> object:
    """Divide the slope of a node by the rate there: it becomes ticks of real time per step.

    ``node``: the solver; ``place``: word at which the node begins in it. A long division with 15-bit digits.
    """
    node = ptr32(int(node) + 4 * place)
    rate = node[_NODE_RATE]
    mantissa = node[_NODE_MANTISSA]
    exponent = node[_NODE_EXPONENT]
    while rate < (1 << 29):
        rate <<= 1
        exponent -= 1
    if mantissa >= rate:
        mantissa >>= 1
        exponent -= 1
    divisor = rate >> 15
    first = mantissa // divisor
    rest = ((mantissa - first * divisor) << 15) - first * (rate & _HALF_MASK)
    rest = (first << 15) + rest // divisor
    node[_NODE_MANTISSA] = rest if rest >> 30 == 0 else _MOST
    node[_NODE_EXPONENT] = exponent if exponent > 0 else 0
