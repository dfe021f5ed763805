"""Coming to rest along the path: real time as a function of the motion's own time.

From the start on, over a length L, the motion's time runs slower and slower: at x = (real time - start) / L its
rate is 1 - S(x), S(x) = 10 x**3 - 15 x**4 + 6 x**5; it stops for good at start + L / 2. With r = 1 - x, the way
left is e(r) = r**4 (2.5 - 3 r + r**2) of L, and the rate e'(r) = r**3 (10 - 15 r + 6 r**2). Nodes are moved by
this law, time and slope; all between them stays as it is. Fractions here have 30 bits.
"""

import micropython
from micropython import const

from armtempo_board.stepgen import bezier
from armtempo_board.stepgen.newton import LAW

TYPE_CHECKING = False
if TYPE_CHECKING:
    from array import array

_LOW = const((1 << 15) - 1)
_LONGEST = const(1 << 28)
_MOST = const((1 << 30) - 1)
_FIVE_EIGHTHS = const(5 << 27)


def set_law(block: "array[int]", start_ticks: int, length_ticks: int) -> None:
    """Brake from a time on over ``length_ticks`` of real time; more than 2**30 (12.8 s) counts as that.

    Written to the block at LAW: length in units of 2**u ticks (28 bits), start in 4096 ticks (+ bezier.BIAS) and
    the rest of it in ticks, u.
    """
    length_ticks = min(length_ticks, 1 << 30)
    unit = 0
    while length_ticks >> unit >= _LONGEST:
        unit += 1
    block[LAW] = max(length_ticks >> unit, 2)
    block[LAW + 1] = (start_ticks >> 12) + bezier.BIAS
    block[LAW + 2] = start_ticks & 4095
    block[LAW + 3] = unit


def passed(block: "array[int]", high: int) -> bool:
    """Whether a time (4096 ticks, + bezier.BIAS) lies behind the end of the way."""
    return bool(high - block[LAW + 1] > (block[LAW] >> 13) + 1 << block[LAW + 3])


@micropython.viper
def slow(block: ptr32, h: int, high: int, scale: int) -> int:
    """Move the time (2**-scale ticks from ``high`` on) of the node at ``h`` to real time; 0: it never comes.

    The whole ticks of delay go to the node's DELAY, the rest to its time; RATE becomes that of the motion's time.
    The compiler keeps the first two arguments in registers: ``block`` becomes the node, ``h`` a high half.
    """
    law = ptr32(int(block) + 240)
    block = ptr32(int(block) + 4 * h)
    one = 1 << 29
    one += one
    block[3] = 0
    block[4] = one
    unit = law[3]
    high -= law[1]
    if high < 0 - (1 << 17):
        return 1
    if high > (1 << 17):
        return 0
    ticks = (high << 12) + (block[0] >> scale) - law[2]
    if ticks <= 0:
        return 1
    length = law[0]
    if (ticks >> unit) >= (length >> 1):
        return 0
    # y: the way gone, ticks / length
    way = ticks >> unit
    rest = ((ticks & ((1 << unit) - 1)) << scale) + (block[0] & ((1 << scale) - 1))
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
    digit = length >> 15
    first = way // digit
    way = ((way - first * digit) << 15) - first * (length & _LOW)
    y = (first << 15) + way // digit
    left = (one >> 1) - y
    if left <= 0:
        return 0
    # r: e(r) = left, by Newton from above, where e is convex
    r = one - y
    rounds = 0
    rate = one
    while rounds < 60:
        rounds += 1
        h = r >> 15
        low = r & _LOW
        square = h * h + ((h * low) >> 14) + ((low * low) >> 30)
        rate = _FIVE_EIGHTHS - r + (r >> 4) + (square >> 2) + (square >> 3)
        way = _FIVE_EIGHTHS - r + (r >> 2) + (square >> 2)
        first = square >> 15
        second = square & _LOW
        cube = first * h + ((first * low) >> 15) + ((second * h) >> 15)
        fourth = first * first + ((first * second) >> 14)
        h = cube >> 15
        low = cube & _LOW
        rate = (h * (rate >> 15) + ((low * (rate >> 15)) >> 15) + ((h * (rate & _LOW)) >> 15)) << 4
        h = fourth >> 15
        low = fourth & _LOW
        way = (h * (way >> 15) + ((low * (way >> 15)) >> 15) + ((h * (way & _LOW)) >> 15)) << 2
        way -= left
        if way <= 0 or rate < (1 << 10):
            break
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
    if rate < (1 << 10):
        return 0
    # the delay: length * (1 - r - y), in ticks and 2**-15 ticks
    way = one - r - y
    if way < 0:
        way = 0
    length = law[0]
    first = length >> 14
    second = length & ((1 << 14) - 1)
    h = way >> 15
    low = way & _LOW
    high = first * h
    low = ((high & 1) << 14) + ((first * low) >> 1) + second * h + ((second * low) >> 15)
    high = ((high >> 1) + (low >> 15)) << unit
    low = (low & _LOW) << unit
    block[3] = high + (low >> 15)
    block[4] = rate
    low &= _LOW
    if scale <= 15:
        block[0] += low >> (15 - scale)
    else:
        block[0] += low << (scale - 15)
    return 1


@micropython.viper
def steepen(block: ptr32, where: int) -> object:
    """Divide the slope of the node at ``where`` by the rate there: ticks of real time per step."""
    block = ptr32(int(block) + 4 * where)
    rate = block[4]
    time = block[1]
    exponent = block[2]
    while rate < (1 << 29):
        rate <<= 1
        exponent -= 1
    if time >= rate:
        time >>= 1
        exponent -= 1
    digit = rate >> 15
    first = time // digit
    rest = ((time - first * digit) << 15) - first * (rate & _LOW)
    rest = (first << 15) + rest // digit
    block[1] = rest if rest >> 30 == 0 else _MOST
    block[2] = exponent if exponent > 0 else 0
