"""Real time as a function of the motion's own time, whose rate is 1 as planned and may be anything below.

The rate is constant but for ramps: over a length L of real time it goes from one value to another. Braking is a ramp to
0. Counted by r, in parts of L, from that end of the ramp at which the rate is least, the rate is b + h S(r), and the
motion's time from there on is b r + h e(r) of L, e the integral of S. S goes from 0 to 1; its slope is 0 at r = 0, s1
at r = p/16, s2 at r = q/16, 0 at r = 1, and linear in between, so e is convex, and of third order in each of the three
pieces. p, q and e(1), a multiple of 1/64, are the shape of the ramp, which the record gives. This law moves the nodes,
time and slope; all steps between them follow. Rates are in thousandths and times at the ends of a ramp in whole ticks,
so outside the ramps real time is exact, however long the motion is. Fractions here have 30 bits.
"""

import micropython
from armtempo_shared.motion import RAMP_SHAPES, RAMP_WAYS
from micropython import const

TYPE_CHECKING = False
if TYPE_CHECKING:
    from array import array

# words of the law; times are pairs of 4096 ticks, + bezier.BIAS, and the rest of it in ticks
LENGTH = const(0)  # of the ramp, 28 bits; in 2**UNIT ticks
UNIT = const(1)
START_HIGH = const(2)  # where the ramp begins, in the motion's time
START_LOW = const(3)
REAL_START_HIGH = const(4)  # and in real time
REAL_START_LOW = const(5)
END_HIGH = const(6)  # where it ends
END_LOW = const(7)
REAL_END_HIGH = const(8)
REAL_END_LOW = const(9)
BEFORE = const(10)  # rate before it, in thousandths,
AFTER = const(11)  # and after it
_LEAST = const(12)  # b
_RISE = const(13)  # h
_SHAPE = const(14)  # p + 16 q
_RATE_1 = const(15)  # S at p/16,
_RATE_2 = const(16)  # and at q/16
_WAY_1 = const(17)  # e at p/16,
_WAY_2 = const(18)  # and at q/16
_GAIN_1 = const(19)  # slope of S at p/16 times the length of the second piece,
_GAIN_2 = const(20)  # and that at q/16 times the length of the third
_WHOLE = const(21)  # b + h e(1)
GIVEN_WORDS = const(22)
# for a joint: what times of the subinterval that is gone through count from, 4096 ticks, + bezier.BIAS
MOTION_HIGH = const(22)  # in the motion's time
REAL_HIGH = const(23)  # and in real time
_SLOPE = const(24)  # results of ``_evaluate``,
_VALUE = const(25)  # and of ``_ticks_of``
_LAST_R = const(26)  # of the node in the ramp that was moved last, near that of the next
LAW_WORDS = const(27)

# words of an end of the ramp, from START_HIGH or END_HIGH on
_MOTION = const(0)
_MOTION_LOW = const(1)
_REAL = const(2)
_REAL_LOW = const(3)

PERMILLE = const(1000)
RAMP_GRID_TICKS = const(64000)
"""Lengths of ramps are multiples of it, so that both ends lie on whole ticks: rates count in 1/1000, e(1) in 1/64."""
LONGEST_RAMP_TICKS = const(1 << 30)

# as in newton.py: words of a node
_NODE_TIME = const(0)
_NODE_MANTISSA = const(1)
_NODE_EXPONENT = const(2)
_NODE_DELAY = const(3)
_NODE_RATE = const(4)
# as in buffers.py: words of a sample
_TICKS_LOW = const(0)
_TICKS_HIGH = const(1)
_PATH_LOW = const(2)
_PATH_HIGH = const(3)

_FRACTION_BITS = const(30)
_BIAS = const(1 << 28)
_HALF_MASK = const((1 << 15) - 1)
_LONGEST = const(1 << 28)
_MOST = const((1 << 30) - 1)
_LEAST_RATE = const(1 << 10)
_LARGEST = const(1 << 17)  # in 4096 ticks: longer than any ramp and subinterval
_AHEAD = const(4096)  # this many thousand units are added, if a time may lie before the ramp
_MOST_ROUNDS = const(60)


def set_times(law: "array[int]", at: int, ticks: int) -> None:
    """Put a time into the words ``at`` and after it."""
    law[at] = (ticks >> 12) + _BIAS
    law[at + 1] = ticks & 4095


def set_length(law: "array[int]", ticks: int) -> None:
    """The length of the ramp, a multiple of RAMP_GRID_TICKS up to LONGEST_RAMP_TICKS."""
    unit = 0
    while ticks >> unit >= _LONGEST:
        unit += 1
    law[LENGTH] = max(ticks >> unit, 2)
    law[UNIT] = unit


def set_ramp(law: "array[int]", shape: int, before: int, after: int) -> None:
    """The shape of the ramp (``armtempo_shared.motion``), and the rates before and after, in thousandths."""
    law[_SHAPE] = RAMP_SHAPES[shape]
    first, second = law[_SHAPE] & 15, law[_SHAPE] >> 4
    way = RAMP_WAYS[shape]
    late = 192 - 4 * (first + second) - 3 * way  # 64ths of the rise that s2 is the cause of
    law[_RATE_1] = ((64 - late) * first << 24) // second
    law[_WAY_1] = first * law[_RATE_1] // 48
    law[_GAIN_1] = ((64 - late) * (second - first) << 25) // second
    law[_GAIN_2] = (late * (16 - second) << 25) // (16 - first)
    law[_RATE_2] = (1 << _FRACTION_BITS) - (law[_GAIN_2] >> 1)
    law[_WAY_2] = (way << 24) - (16 - second) * ((1 << _FRACTION_BITS) - law[_GAIN_2] // 6) // 16
    law[BEFORE] = before
    law[AFTER] = after
    law[_LEAST] = (min(before, after) << _FRACTION_BITS) // PERMILLE
    law[_RISE] = (abs(after - before) << _FRACTION_BITS) // PERMILLE
    law[_WHOLE] = law[_LEAST] + (law[_RISE] * way >> 6)


@micropython.viper
def _evaluate(law: ptr32, r: int, left: int) -> int:
    """Set _SLOPE to b + h S(r), _VALUE to b r + h e(r); with a ``left`` from 0 on, first r so that this is ``left``.

    Returns r. Newton's method, from an r that is near: it takes about 900 instructions a round, two or three of them
    from the node before, six to twelve from an end of the ramp.
    """
    rounds = 0
    sign = 1  # -1: it has come down, and goes up no more, as the last units are rounded
    while True:
        # The piece of the shape: its length in 16ths, what S and e are at its beginning, and its way from there
        first = law[_SHAPE] & 15
        second = law[_SHAPE] >> 4
        if r < first << 26:
            width = first
            u = r
            gain = rate = way = 0
            bend = law[_RATE_1]
        elif r < second << 26:
            width = second - first
            u = r - (first << 26)
            gain = law[_GAIN_1]
            rate = law[_RATE_1]
            way = law[_WAY_1]
            bend = law[_RATE_2] - rate - gain
        else:
            width = 16 - second
            u = r - (second << 26)
            gain = law[_GAIN_2]
            rate = law[_RATE_2]
            way = law[_WAY_2]
            bend = _MOST - rate - gain + 1
        first = u // width
        u = (first << 4) + ((u - first * width) << 4) // width  # of the piece
        digit = u >> 15
        low = u & _HALF_MASK
        bend = (bend >> 15) * digit + (((bend & _HALF_MASK) * digit) >> 15) + (((bend >> 15) * low) >> 15)
        second = (gain >> 1) + bend // 3
        second = (
            (second >> 15) * digit + (((second & _HALF_MASK) * digit) >> 15) + (((second >> 15) * low) >> 15)
        )
        second += rate
        second = (
            (second >> 15) * digit + (((second & _HALF_MASK) * digit) >> 15) + (((second >> 15) * low) >> 15)
        )
        way += (second >> 4) * width + (((second & 15) * width) >> 4)
        gain += bend
        rate += (gain >> 15) * digit + (((gain & _HALF_MASK) * digit) >> 15) + (((gain >> 15) * low) >> 15)
        digit = r >> 15
        low = r & _HALF_MASK
        first = law[_RISE] >> 15
        second = law[_RISE] & _HALF_MASK
        rate = first * (rate >> 15) + ((second * (rate >> 15)) >> 15) + ((first * (rate & _HALF_MASK)) >> 15)
        way = first * (way >> 15) + ((second * (way >> 15)) >> 15) + ((first * (way & _HALF_MASK)) >> 15)
        first = law[_LEAST] >> 15
        second = law[_LEAST] & _HALF_MASK
        rate += law[_LEAST]
        way += first * digit + ((second * digit) >> 15) + ((first * low) >> 15)
        law[_SLOPE] = rate
        law[_VALUE] = way
        if left < 0:
            break
        way -= left
        rounds += 1
        if way == 0 or (way < 0 and sign < 0) or rounds > _MOST_ROUNDS:
            break
        sign = -1
        if way < 0:
            sign = 1
            way = 0 - way
        if rate < _LEAST_RATE:
            if sign < 0:
                break
            r = _MOST  # so flat that r would leap: from the other end
            continue
        # The Newton step, way / rate, with as many bits as fit; rounded down. As e is convex, r is too large after it
        low = 15
        while rate < (1 << 29):
            rate <<= 1
            low += 1
        while way < (1 << 28):
            way <<= 1
            low -= 1
        way = way // ((rate >> 15) + 1)
        first = r
        if low > 29 or way >> (30 - low):  # beyond the other end
            way = _MOST
        elif low >= 0:
            way <<= low
        else:
            way >>= 0 - low
        if way == 0:
            break
        r += sign * way
        if r < 0:
            r = 0
        if r > _MOST:
            r = _MOST
        if r == first:
            break
    return r


@micropython.viper
def _share(law: ptr32, ticks: int, fraction: int, scale: int) -> int:
    """Ticks, and a fraction with ``scale`` bits, as a share of the ramp's length: a long division in 15-bit digits."""
    unit = law[UNIT]
    length = law[LENGTH]
    way = ticks >> unit
    rest = ((ticks & ((1 << unit) - 1)) << scale) + fraction
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
    way = (first << 15) + way // divisor
    return way if way >> 30 == 0 else _MOST


@micropython.viper
def _ticks_of(law: ptr32, share: int) -> int:
    """Set _VALUE to a share of the ramp's length in whole ticks; returns the rest in 2**-15 ticks."""
    first = law[LENGTH] >> 14
    second = law[LENGTH] & ((1 << 14) - 1)
    unit = law[UNIT]
    digit = share >> 15
    low = share & _HALF_MASK
    high = first * digit
    low = ((high & 1) << 14) + ((first * low) >> 1) + second * digit + ((second * low) >> 15)
    high = ((high >> 1) + (low >> 15)) << unit
    low = (low & _HALF_MASK) << unit
    law[_VALUE] = high + (low >> 15)
    return low & _HALF_MASK


@micropython.viper
def to_real_time(given: object, node: ptr32, place: int, scale: int) -> int:
    """Move the time of a node, 2**-scale ticks from MOTION_HIGH on, to real time; 0: it never comes, else 1.

    ``given``: the law; ``node``: the solver; ``place``: word at which the node begins in it. NODE_DELAY becomes the
    whole ticks from REAL_HIGH on, the time the rest; NODE_RATE becomes that of the motion's time. ``node`` becomes
    the node, ``place`` many things, as the compiler keeps the arguments in registers.
    """
    law = ptr32(given)  # type: ignore[arg-type]
    high = law[REAL_HIGH]
    node = ptr32(int(node) + 4 * place)
    motion = law[MOTION_HIGH]
    whole = node[_NODE_TIME] >> scale
    fraction = node[_NODE_TIME] & ((1 << scale) - 1)
    anchor = END_HIGH
    in_ramp = 0
    rate = law[AFTER]
    place = motion - law[END_HIGH]
    if place < 0 - _LARGEST or (place < _LARGEST and (place << 12) + whole < law[END_LOW]):
        anchor = START_HIGH
        rate = law[BEFORE]
        place = motion - law[START_HIGH]
        if place >= 0 - _LARGEST:
            place = (place << 12) + whole - law[START_LOW]
            if place > 0 or (place == 0 and fraction):
                in_ramp = 1
    if in_ramp:
        # In the ramp: from that of its ends on at which the rate is least
        rising = 1 if law[AFTER] > rate else 0
        place = int(_share(given, place, fraction, scale))
        if not rising:
            place = law[_WHOLE] - place
            if place < 0:
                place = 0
        place = int(_evaluate(given, law[_LAST_R], place))
        law[_LAST_R] = place
        rate = law[_SLOPE]
        if rate < _LEAST_RATE:
            if not rising:
                return 0
            rate = _LEAST_RATE
        if not rising:
            place = _MOST - place
        fraction = int(_ticks_of(given, place))
        node[_NODE_DELAY] = ((law[REAL_START_HIGH] - high) << 12) + law[REAL_START_LOW] + law[_VALUE]
        node[_NODE_RATE] = rate
        place = 15
    elif not rate:
        # At rest; but what comes at the very end of a pause comes as it ends
        if anchor == END_HIGH:
            return 0
        node[_NODE_DELAY] = ((law[REAL_START_HIGH] - high) << 12) + law[REAL_START_LOW]
        node[_NODE_RATE] = _LEAST_RATE
        fraction = place = 0
    else:
        # A constant rate: ``rate`` ticks of the motion are 1000 ticks of real time
        law = ptr32(int(law) + 4 * anchor)
        place = motion - law[_MOTION] + rate * _AHEAD - 1
        motion = place // rate
        whole += ((place - motion * rate + 1) << 12) - law[_MOTION_LOW]
        motion = law[_REAL] - high + PERMILLE * (motion - _AHEAD)
        place = whole // rate
        whole -= place * rate
        fraction = (fraction >> (scale - 10)) if scale > 10 else (fraction << (10 - scale))
        fraction = ((whole << 10) + fraction) * PERMILLE // rate
        node[_NODE_DELAY] = (motion << 12) + law[_REAL_LOW] + PERMILLE * place + (fraction >> 10)
        fraction &= 1023
        place = (rate << 20) // PERMILLE
        node[_NODE_RATE] = (place << 10) + (((rate << 20) - place * PERMILLE) << 10) // PERMILLE
        place = 10
    if scale <= place:
        fraction >>= place - scale
    else:
        fraction <<= scale - place
    node[_NODE_TIME] = fraction
    return 1


@micropython.viper
def to_motion_time(given: object, sample: ptr32, at: int) -> object:
    """Put the motion's time by a law, ``given``, into a sample that begins at word ``at`` (buffers.py)."""
    law = ptr32(given)  # type: ignore[arg-type]
    sample = ptr32(int(sample) + 4 * at)
    low = sample[_TICKS_LOW]
    high = ((sample[_TICKS_HIGH] << 20) | ((low >> 12) & 0xFFFFF)) + _BIAS
    low &= 4095
    in_ramp = 0
    anchor = END_HIGH
    rate = law[AFTER]
    place = high - law[REAL_END_HIGH]
    if place < 0 or (place == 0 and low < law[REAL_END_LOW]):
        anchor = START_HIGH
        rate = law[BEFORE]
        place = high - law[REAL_START_HIGH]
        if place > 0 or (place == 0 and low > law[REAL_START_LOW]):
            in_ramp = 1
    if in_ramp:
        rising = 1 if law[AFTER] > rate else 0
        place = int(_share(given, (place << 12) + low - law[REAL_START_LOW], 0, 0))
        if not rising:
            place = _MOST - place
        _evaluate(given, place, -1)
        place = law[_VALUE]
        if not rising:
            place = law[_WHOLE] - place
            if place < 0:
                place = 0
        _ticks_of(given, place)
        high = law[START_HIGH]
        low = law[START_LOW] + law[_VALUE]
    else:
        law = ptr32(int(law) + 4 * anchor)
        place += PERMILLE * _AHEAD - 1
        high = place // PERMILLE
        low += ((place - high * PERMILLE + 1) << 12) - law[_REAL_LOW]
        high = law[_MOTION] + rate * (high - _AHEAD)
        place = low // PERMILLE
        low = law[_MOTION_LOW] + rate * place + rate * (low - place * PERMILLE) // PERMILLE
    high += (low >> 12) - _BIAS
    sample[_PATH_LOW] = (high << 12) | (low & 4095)
    sample[_PATH_HIGH] = high >> 20


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
