"""The board's check of a motion before each start.

Subintervals are checked by the convex hulls of their Bezier points, and halved if that is not decisive, so
the result is proven, not sampled.
"""

import struct

from armtempo_shared import codes
from armtempo_shared.limits import (
    LONGEST_TICKS,
    MOST_SPAN_STEPS,
    MOST_STEPS,
    STEP_FRACTION_BITS,
    TICK_FRACTION_BITS,
    TICK_HZ,
)
from micropython import const

from armtempo_board import step_rates
from armtempo_board.errors import Refused
from armtempo_board.memory import bytes_of
from armtempo_board.motion import rate_check
from armtempo_board.stepgen import subdivision
from armtempo_board.stepgen.bezier import BIAS, HIGH, LAST_HIGH, LAST_LOW, LOW
from armtempo_board.stepgen.control_points import BOUNDED, EQUAL, RISING, survey
from armtempo_board.stepgen.subdivision import (
    DIFFERENCE_BIAS,
    FIRST_DIFFERENCE,
    LAST_DIFFERENCE,
    LEAST,
    MOST,
    SCALE,
)

TYPE_CHECKING = False
if TYPE_CHECKING:
    from armtempo_shared.motion import MotionHead

    from armtempo_board.stepgen.control_points import ControlPoints
    from armtempo_board.stepgen.subintervals import Subintervals

_SHORT_TICKS = const(1024)
_HIGH_TICKS_BITS = const(12)  # a high word of time counts 2**12 ticks
_BOUND_OF_TIME = const(1 << 26)  # LONGEST_TICKS in these
_PASS = const(0)
_SPLIT = const(-1)


def check(
    motion: "MotionHead",
    joints: "list[dict[str, int]]",
    gap_ticks: int,
    interval: "Subintervals",
) -> int:
    """Raise Refused for the first error, with the joint and a value. Returns one bit per joint that does not stand.

    ``joints``: the joints' rows of the arm record; ``gap_ticks``: see ``StepGenerator.load``. ``interval``:
    reused for the walk through the motion, to save heap. The value is, by code: time_order, the control
    point; too_long, ticks or steps of 2**28; out_of_range, the position in steps; too_fast, steps/s;
    too_abrupt, steps/s**2.
    """
    moving = 0
    try:
        for joint in range(motion.joints):
            if joint == 0 or not motion.shared:
                _check_spline(motion, joint, motion.time_offset(joint), True, interval.points)
            if _check_spline(motion, joint, motion.angle_offset(joint), False, interval.points):
                moving |= 1 << joint
                interval.load(motion, joint)
                _check_joint(interval, Judge(interval, joints[joint], gap_ticks), joint)
            else:
                _check_standing(motion, joints[joint], joint)
        rate_check.check_sum(motion, joints, moving, interval)
        return moving
    finally:
        interval.close()


def _check_joint(interval: "Subintervals", judge: "Judge", joint: int) -> None:
    while measured := interval.measure():
        code = judge.verdict(measured)
        if code == _SPLIT:
            interval.advance(subdivision.SPLIT)
        elif code:
            raise Refused(code, joint, judge.value)
        else:
            interval.advance(subdivision.SKIP)


def _check_standing(motion: "MotionHead", row: "dict[str, int]", joint: int) -> None:
    """Check the range of a joint that stands, of which nothing else can be wrong."""
    (point,) = motion.points(motion.angle_offset(joint), 1)
    position = (point >> STEP_FRACTION_BITS - 1) + 1 >> 1
    if not row["min_steps"] <= position <= row["max_steps"]:
        raise Refused(codes.OUT_OF_RANGE, joint, position)


def _check_spline(
    motion: "MotionHead", joint: int, offset: int, is_time: bool, points: "ControlPoints"
) -> bool:
    """Check that all numbers are within the range of the step generator, and that those of time increase.

    Returns whether they differ at all.
    """
    count = motion.degree + 1
    segments = motion.segments * motion.refine if is_time else motion.segments
    wanted = BOUNDED | RISING if is_time else BOUNDED
    bound = _BOUND_OF_TIME if is_time else MOST_STEPS
    differ = False
    points.open(motion.stream(offset), motion.degree)
    for segment in range(segments):
        at = points.seek(segment)
        found = survey(points.words, at, count, bound)
        if found & wanted != wanted:
            numbers = struct.unpack("<%dq" % count, bytes_of(points.words, at, at + 2 * count))
            _check_segment(numbers, joint, segment, is_time)
        if not found & EQUAL:
            differ = True
    return differ


def _check_segment(control: "tuple[int, ...]", joint: int, segment: int, is_time: bool) -> None:
    if is_time:
        for i in range(len(control) - 1):
            if control[i] >= control[i + 1]:
                raise Refused(codes.TIME_ORDER, joint, segment + i + 1)
    span = max(control) - min(control)
    most = max(max(control), -min(control))
    # the same for time: LONGEST_SPAN_TICKS with its fraction bits is this number too
    if span >= MOST_SPAN_STEPS << STEP_FRACTION_BITS or most >= MOST_STEPS << STEP_FRACTION_BITS:
        raise Refused(codes.TOO_LONG, joint, most)
    if is_time and most >> TICK_FRACTION_BITS >= LONGEST_TICKS:
        raise Refused(codes.TOO_LONG, joint, most >> TICK_FRACTION_BITS)


class Judge:
    """Checks the subintervals of one joint; ``value`` is the value of a failure."""

    def __init__(self, interval: "Subintervals", row: "dict[str, int]", gap_ticks: int) -> None:
        self._interval = interval
        self._gap_ticks = gap_ticks
        self._low = row["min_steps"] + BIAS
        self._high = row["max_steps"] + BIAS
        rate = min(row["max_rate"], step_rates.one + step_rates.one // 100)
        self._limits = rate_check.limits(self._low, self._high, rate, gap_ticks)

    def verdict(self, measured: int) -> int:
        """A code, _PASS, or _SPLIT if its halves must be checked; ``measured``: the result of ``measure``."""
        interval = self._interval
        angle = interval.angle
        measures, time, limits = interval.angle_measures, interval.time_measures, self._limits
        if (  # nearly all pass here; what comes below decides the others exactly, in slow byte code
            rate_check.is_inside(angle, measures, time, limits)
            and rate_check.compare(measures, time, limits) == rate_check.SLOWER
            and (
                measured & subdivision.ANGLE_STEADY
                or (measured & subdivision.TIME_STEADY and rate_check.is_gentle(measures, time, limits))
            )
        ):
            return _PASS
        for high, low in ((HIGH, LOW), (LAST_HIGH, LAST_LOW)):
            position = angle[high] + (angle[low] >> 27)
            if not self._low <= position <= self._high:
                self.value = position - BIAS
                return codes.OUT_OF_RANGE
        if not interval.angle_measures[SCALE] or not interval.time_measures[SCALE]:
            return _SPLIT
        return self._range() or self._rate() or self._reversal(measured)

    def _is_short(self) -> bool:
        time = self._interval.time
        high = time[LAST_HIGH] - time[HIGH]
        return high < 2 and (high << _HIGH_TICKS_BITS) + (time[LAST_LOW] - time[LOW] >> 16) <= _SHORT_TICKS

    def _range(self) -> int:
        """Range: proven if all points of the hull are within the joint's range."""
        measures = self._interval.angle_measures
        is_inside = self._low <= measures[subdivision.LOWEST] and measures[subdivision.HIGHEST] <= self._high
        return _PASS if is_inside or self._is_short() else _SPLIT

    def _rate(self) -> int:
        """Rate: proven if |angle'| <= rate * time' for all Bezier points of the derivatives."""
        interval = self._interval
        found = rate_check.compare(interval.angle_measures, interval.time_measures, self._limits)
        if found == rate_check.SLOWER:
            return _PASS
        if found == rate_check.UNDECIDED and not self._is_short():
            return _SPLIT
        is_certain = found == rate_check.FASTER
        self.value = rate_check.at_ends(interval) if is_certain else rate_check.highest(interval)
        return codes.TOO_FAST

    def _reversal(self, measured: int) -> int:
        """Reversal: at standstill, acceleration may move the joint at most 0.02 steps in half a gap.

        Two opposite steps closer than the gap are left out; the angle then passes the half step by up to a
        gap**2 / 8 for an acceleration a.
        """
        interval = self._interval
        if measured & subdivision.ANGLE_STEADY:
            return _PASS
        if not measured & subdivision.TIME_STEADY:
            return _SPLIT
        numerator, denominator = _acceleration(interval.angle_measures, interval.time_measures)
        if numerator * self._gap_ticks**2 * 100 <= denominator * 16:
            return _PASS
        if not self._is_short():
            return _SPLIT
        self.value = numerator * TICK_HZ * TICK_HZ // denominator
        return codes.TOO_ABRUPT


def _acceleration(angle: "memoryview[int]", time: "memoryview[int]") -> "tuple[int, int]":
    """An upper bound of |angle'' / time'**2 - angle' time'' / time'**3|, steps/tick**2: (numerator, denominator)."""
    least = time[LEAST] - DIFFERENCE_BIAS
    most = max(abs(angle[LEAST] - DIFFERENCE_BIAS), abs(angle[MOST] - DIFFERENCE_BIAS))
    numerator = 4 * (_second_difference(angle) * least + most * _second_difference(time))
    denominator = 5 * least**3
    scale = 2 * (time[SCALE] - _HIGH_TICKS_BITS) - angle[SCALE]
    return (numerator << scale, denominator) if scale >= 0 else (numerator, denominator << -scale)


def _second_difference(measures: "memoryview[int]") -> int:
    """The greatest second difference of the points, absolute."""
    return max([abs(measures[i + 1] - measures[i]) for i in range(FIRST_DIFFERENCE, LAST_DIFFERENCE)])
