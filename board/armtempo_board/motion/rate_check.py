"""Step rates of parts against a limit."""

from array import array

import micropython
from armtempo_shared import codes
from armtempo_shared.limits import MAX_STEP_RATE_SUM, TICK_HZ
from micropython import const

from armtempo_board.errors import Refused
from armtempo_board.stepgen import bezier, subdivision

TYPE_CHECKING = False
if TYPE_CHECKING:
    from armtempo_shared.motion import Motion

    from armtempo_board.stepgen.subintervals import Subintervals

SLOWER = 1
UNDECIDED = 0
FASTER = -1
_BINS = const(128)
_D_BIAS = const(1 << 29)


def scaled(rate: int) -> "tuple[int, int]":
    """(mantissa of 30 bits, exponent): ``rate`` steps/s in steps per tick is mantissa / 2**exponent."""
    exponent = 0
    while (rate << exponent) // TICK_HZ < 1 << 29:
        exponent += 1
    return (rate << exponent) // TICK_HZ, exponent


@micropython.viper
def compare(angle: ptr32, time: ptr32, mantissa: int, shift: int) -> int:
    """Whether a part keeps a rate: its differences against those of time * mantissa / 2**(30 - shift).

    At the ends the differences are the rate itself: FASTER there is certain.
    """
    found = 1
    high = mantissa >> 15
    low = mantissa & ((1 << 15) - 1)
    i = 1
    while i < 6:
        step = angle[i] - _D_BIAS
        if step < 0:
            step = 0 - step
        tick = time[i] - _D_BIAS
        if tick < 0:
            return 0
        most = (tick >> 15) * high + (((tick & ((1 << 15) - 1)) * high) >> 15) + (((tick >> 15) * low) >> 15)
        if shift >= 0:
            step = (step >> shift) if shift < 31 else 0
        else:
            most = (most >> (0 - shift)) if shift > -31 else 0
        if step > most + 4:
            found = 0
            if i == 1 or i == 5:
                return -1
        i += 1
    return found


def highest(parts: "Subintervals") -> int:
    """A bound of the part's rate in steps/s."""
    angle, time = parts.angle_local, parts.time_local
    most = max(abs(angle[subdivision.LEAST] - _D_BIAS), abs(angle[subdivision.MOST] - _D_BIAS))
    return _rate(parts, most, time[subdivision.LEAST] - _D_BIAS)


def at_ends(parts: "Subintervals") -> int:
    """The greater of the part's rates at its two ends, in steps/s."""
    angle, time = parts.angle_local, parts.time_local
    return max(
        [
            _rate(parts, abs(angle[i] - _D_BIAS), time[i] - _D_BIAS)
            for i in (subdivision.STEPS, subdivision.STEPS + 4)
        ]
    )


def _rate(parts: "Subintervals", steps: int, ticks: int) -> int:
    """Differences of angle and time, in their local units, as steps/s."""
    if ticks <= 0:
        return TICK_HZ
    up = parts.time_local[subdivision.SCALE] - 12
    return min((steps * TICK_HZ << up) // (ticks << parts.angle_local[subdivision.SCALE]), TICK_HZ)


def check_sum(motion: "Motion", joints: "list[dict[str, int]]", parts: "Subintervals") -> None:
    """Refused (too_fast, no joint, rate) where all joints together may step too fast in one of many time spans."""
    limit = MAX_STEP_RATE_SUM + MAX_STEP_RATE_SUM // 100
    if sum([row["max_rate"] for row in joints]) <= limit:
        return
    longest = max([_end_high(motion, joint) for joint in range(motion.joints)])
    width = longest // _BINS + 1
    sums = array("I", bytes(4 * (_BINS + 1)))
    for joint in range(motion.joints):
        _add(parts, motion, joint, width, sums)
    worst = max(sums)
    if worst > limit:
        raise Refused(codes.TOO_FAST, value=worst)


def _end_high(motion: "Motion", joint: int) -> int:
    parts_end = motion.time_offset(joint) + 8 * (motion.segments * motion.refine + motion.degree) - 1
    data = motion.data
    high = 0
    for i in range(4):
        high = high << 8 | data[parts_end - i]
    return int(high << 4 | data[parts_end - 4] >> 4) + 1


def _add(parts: "Subintervals", motion: "Motion", joint: int, width: int, sums: "array[int]") -> None:
    """Add the joint's highest rate in each time span of ``width`` * 4096 ticks."""
    peaks = array("I", bytes(4 * (_BINS + 1)))
    parts.load(motion, joint)
    while parts.measure():
        whole = parts.angle_local[subdivision.SCALE] and parts.time_local[subdivision.SCALE]
        if not whole or parts.time[5] - parts.time[0] > width:
            parts.split()
            continue
        rate = highest(parts)
        first = max(parts.time[0] - bezier.BIAS, 0) // width
        last = min((parts.time[5] - bezier.BIAS) // width, _BINS)
        for i in range(first, last + 1):
            peaks[i] = max(peaks[i], rate)
        parts.skip()
    for i in range(_BINS + 1):
        sums[i] += peaks[i]
