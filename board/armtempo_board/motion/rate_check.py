"""Step rates of subintervals against a limit."""

from array import array

import micropython
from armtempo_shared import codes
from armtempo_shared.limits import TICK_HZ
from micropython import const

from armtempo_board import step_rates
from armtempo_board.errors import Refused
from armtempo_board.stepgen.bezier import BIAS, HIGH, LAST_HIGH, LOW_BITS
from armtempo_board.stepgen.subdivision import (
    DIFFERENCE_BIAS,
    FIRST_DIFFERENCE,
    LAST_DIFFERENCE,
    LEAST,
    MOST,
    SCALE,
    SKIP,
    SPLIT,
)

TYPE_CHECKING = False
if TYPE_CHECKING:
    from armtempo_shared.motion import MotionHead

    from armtempo_board.stepgen.subintervals import Subintervals

SLOWER = const(1)
UNDECIDED = const(0)
FASTER = const(-1)

# words of ``limits``: the rate in steps per tick is mantissa / 2**exponent, the mantissa of 30 bits
_LOW = const(0)
_HIGH = const(1)
_MANTISSA = const(2)
_EXPONENT = const(3)
_GAP = const(4)  # five times its square is this, of 9 bits, times 2**GAP_BITS
_GAP_BITS = const(5)
_ROUNDED = const(512)
# as in bezier.py: words of a piece
_FIRST_HIGH = const(0)  # = HIGH
_FIRST_LOW = const(6)  # = LOW
_LAST_HIGH = const(5)
_LAST_LOW = const(11)
# as in subdivision.py: measures
_SCALE = const(0)
_LEAST = const(6)
_MOST = const(7)
_LOWEST = const(8)
_HIGHEST = const(9)
_FIRST_DIFFERENCE = const(1)
_LAST_DIFFERENCE = const(5)
_DIFFERENCE_BIAS = const(1 << 29)

_HALF_MASK = const((1 << 15) - 1)
_POINT_BYTES = const(8)
_SPANS = const(128)  # of time, in which the joints' rates are summed
_HIGH_TICKS_BITS = const(12)  # a high word of time counts 2**12 ticks


def limits(low: int, high: int, rate: int, gap_ticks: int) -> "array[int]":
    """A joint's limits for the functions below.

    Its range (+ bezier.BIAS), its rate in steps/s, and the least time between opposite steps.
    """
    exponent = 56
    while rate >> 56 - exponent:
        exponent -= 1
    if (rate << exponent) // TICK_HZ < 1 << 29:
        exponent += 1
    gap_bits = 0
    gap = 5 * gap_ticks**2
    while gap >> gap_bits >= _ROUNDED:
        gap_bits += 1
    return array("i", (low, high, (rate << exponent) // TICK_HZ, exponent, (gap >> gap_bits) + 1, gap_bits))


@micropython.viper
def is_inside(piece: ptr32, angle: ptr32, time: ptr32, limits: ptr32) -> int:
    """Whether a subinterval was measured and is certainly within the joint's range.

    ``piece``: of the angle; ``angle``, ``time``: its measures.
    """
    low = limits[_LOW]
    high = limits[_HIGH]
    begin = piece[_FIRST_HIGH] + (piece[_FIRST_LOW] >> 27)
    end = piece[_LAST_HIGH] + (piece[_LAST_LOW] >> 27)
    if angle[_SCALE] == 0 or time[_SCALE] == 0 or begin < low or begin > high or end < low or end > high:
        return 0
    return 1 if angle[_LOWEST] >= low and angle[_HIGHEST] <= high else 0


@micropython.viper
def is_gentle(angle: ptr32, time: ptr32, limits: ptr32) -> int:
    """Whether acceleration certainly moves the joint little enough at standstill, see ``Judge``; time is steady.

    ``angle``, ``time``: a subinterval's measures. As ``Judge`` has it exactly, in numbers of 9 bits, each rounded to
    the safe side: with all of them near their limits 2 % too strict.
    """
    most = steps_change = ticks_change = 0
    i = _FIRST_DIFFERENCE
    while i < _LAST_DIFFERENCE:
        change = angle[i + 1] - angle[i]
        if change < 0:
            change = 0 - change
        if change > steps_change:
            steps_change = change
        change = time[i + 1] - time[i]
        if change < 0:
            change = 0 - change
        if change > ticks_change:
            ticks_change = change
        i += 1
    most = angle[_MOST] - _DIFFERENCE_BIAS
    change = _DIFFERENCE_BIAS - angle[_LEAST]
    if change > most:
        most = change
    least = time[_LEAST] - _DIFFERENCE_BIAS
    bits = 0
    while least >= _ROUNDED:
        least >>= 1
        ticks_change >>= 1
        bits += 1
    shift = limits[_GAP_BITS] + 2 * (time[_SCALE] - _HIGH_TICKS_BITS) - angle[_SCALE] - 2 * bits
    while most >= _ROUNDED or steps_change >= _ROUNDED:
        most >>= 1
        steps_change >>= 1
        shift += 1
    left = ((steps_change + 1) * (least + 1) + (most + 1) * (ticks_change + 1)) * limits[_GAP]
    right = least * least * least
    if shift >= 0:
        right = (right >> shift) if shift < 31 else 0
    else:
        left = ((left >> (0 - shift)) if shift > -31 else 0) + 1
    return 1 if left <= right else 0


@micropython.viper
def compare(angle: ptr32, time: ptr32, limits: ptr32) -> int:
    """Compare a subinterval with a rate: its differences with those of time, times the rate.

    ``angle``, ``time``: its measures. At the ends the differences give the exact rate, so FASTER is certain there.
    """
    found = SLOWER
    shift = 30 - limits[_EXPONENT] + angle[_SCALE] - time[_SCALE] + _HIGH_TICKS_BITS
    mantissa = limits[_MANTISSA]
    high = mantissa >> 15
    low = mantissa & _HALF_MASK
    i = _FIRST_DIFFERENCE
    while i <= _LAST_DIFFERENCE:
        step = angle[i] - _DIFFERENCE_BIAS
        if step < 0:
            step = 0 - step
        tick = time[i] - _DIFFERENCE_BIAS
        if tick < 0:
            return UNDECIDED
        most = (tick >> 15) * high + (((tick & _HALF_MASK) * high) >> 15) + (((tick >> 15) * low) >> 15)
        if shift >= 0:
            step = (step >> shift) if shift < 31 else 0
        else:
            most = (most >> (0 - shift)) if shift > -31 else 0
        if step > most + 4:
            found = UNDECIDED
            if i == _FIRST_DIFFERENCE or i == _LAST_DIFFERENCE:  # noqa: SIM109  viper knows no tuples
                return FASTER
        i += 1
    return found


def highest(interval: "Subintervals") -> int:
    """An upper bound of the subinterval's rate in steps/s."""
    angle, time = interval.angle_measures, interval.time_measures
    most = max(abs(angle[LEAST] - DIFFERENCE_BIAS), abs(angle[MOST] - DIFFERENCE_BIAS))
    return _rate(interval, most, time[LEAST] - DIFFERENCE_BIAS)


def at_ends(interval: "Subintervals") -> int:
    """The greater of the subinterval's rates at its two ends, in steps/s."""
    angle, time = interval.angle_measures, interval.time_measures
    rates = [
        _rate(interval, abs(angle[i] - DIFFERENCE_BIAS), time[i] - DIFFERENCE_BIAS)
        for i in (FIRST_DIFFERENCE, LAST_DIFFERENCE)
    ]
    return max(rates)


def _rate(interval: "Subintervals", steps: int, ticks: int) -> int:
    """Differences of angle and time, in their local units, as steps/s."""
    if ticks <= 0:
        return TICK_HZ
    up = interval.time_measures[SCALE] - _HIGH_TICKS_BITS
    return min((steps * TICK_HZ << up) // (ticks << interval.angle_measures[SCALE]), TICK_HZ)


def check_sum(
    motion: "MotionHead", joints: "list[dict[str, int]]", moving: int, interval: "Subintervals"
) -> None:
    """Raise Refused (too_fast, no joint, rate) if the sum of all rates may be too high in one of many spans of time.

    ``moving``: one bit per joint that does not stand.
    """
    limit = step_rates.together + step_rates.together // 100
    if sum([row["max_rate"] for row in joints]) <= limit:
        return
    longest = max([_end_high(motion, joint) for joint in range(motion.joints)])
    width = longest // _SPANS + 1
    sums = array("I", bytes(4 * (_SPANS + 1)))
    for joint in [joint for joint in range(motion.joints) if moving >> joint & 1]:
        _add(interval, motion, joint, width, sums)
    worst = max(sums)
    if worst > limit:
        raise Refused(codes.TOO_FAST, value=worst)


def _end_high(motion: "MotionHead", joint: int) -> int:
    """The last time control point in 4096 ticks, rounded up."""
    at = motion.time_offset(joint) + _POINT_BYTES * (motion.segments * motion.refine + motion.degree - 1)
    (last,) = motion.points(at, 1)
    return (last >> LOW_BITS) + 1


def _add(interval: "Subintervals", motion: "MotionHead", joint: int, width: int, sums: "array[int]") -> None:
    """Add the joint's highest rate in each span of ``width`` * 4096 ticks."""
    peaks = array("I", bytes(4 * (_SPANS + 1)))
    interval.load(motion, joint)
    while interval.measure():
        is_measured = interval.angle_measures[SCALE] and interval.time_measures[SCALE]
        begin, end = interval.time[HIGH], interval.time[LAST_HIGH]
        if not is_measured or end - begin > width:
            interval.advance(SPLIT)
            continue
        rate = highest(interval)
        first = max(begin - BIAS, 0) // width
        last = min((end - BIAS) // width, _SPANS)
        for i in range(first, last + 1):
            peaks[i] = max(peaks[i], rate)
        interval.advance(SKIP)
    for i in range(_SPANS + 1):
        sums[i] += peaks[i]
