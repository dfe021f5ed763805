"""Is a motion fit to be run? Judged by the board itself before each start.

Whole segments are judged by the hulls of their polynomials, and halved where that does not decide: what
passes is proven, not sampled.
"""

import struct

from armtempo_shared import codes
from armtempo_shared.limits import MAX_STEP_RATE, TICK_FRACTION_BITS, TICK_HZ
from micropython import const

from armtempo_board.errors import Refused
from armtempo_board.motion import rate_check
from armtempo_board.stepgen import bezier, subdivision
from armtempo_board.stepgen.subintervals import Subintervals

TYPE_CHECKING = False
if TYPE_CHECKING:
    from array import array

    from armtempo_shared.motion import Motion

LONGEST_TICKS = 1 << 38
"""A little under an hour: 1024-tick units stay small integers."""

GAP_TICKS = const(25200)
"""Least time between opposite steps that is reckoned with where none is given: 0.3 ms."""

_SHORT_TICKS = const(1024)
_PASS = const(0)
_SPLIT = const(-1)


def check(
    motion: "Motion",
    joints: "list[dict[str, int]]",
    gap_ticks: int = GAP_TICKS,
    parts: "Subintervals | None" = None,
) -> None:
    """Refused where something is wrong, with the joint and a value.

    ``joints``: the joints' rows of the arm record; ``gap_ticks``: see ``Walker.load``. ``parts``: lent for
    the walk through the motion, for the sake of the heap.
    ``value`` is, by code: time_order, the control point;
    too_long, ticks or steps of 2**28; out_of_range, the position in steps; too_fast, steps/s;
    too_abrupt, steps/s**2.
    """
    parts = parts or Subintervals()
    for joint in range(motion.joints):
        _check_numbers(motion, joint)
        parts.load(motion, joint)
        judge = Judge(parts, joints[joint], gap_ticks)
        while found := parts.measure():
            code = judge.verdict(found)
            if code == _SPLIT:
                parts.split()
            elif code:
                raise Refused(code, joint, judge.value)
            else:
                parts.skip()
    rate_check.check_sum(motion, joints, parts)


def _check_numbers(motion: "Motion", joint: int) -> None:
    """Increasing time control points, and all numbers within what the evaluator can hold."""
    count = motion.degree + 1
    for offset, segments, is_time in (
        (motion.time_offset(joint), motion.segments * motion.refine, True),
        (motion.angle_offset(joint), motion.segments, False),
    ):
        for segment in range(segments):
            control = struct.unpack_from("<%dq" % count, motion.data, offset + 8 * segment)
            if is_time:
                for i in range(count - 1):
                    if control[i] >= control[i + 1]:
                        raise Refused(codes.TIME_ORDER, joint, segment + i + 1)
            span = max(control) - min(control)
            most = max(max(control), -min(control))
            if span >> bezier.LOW_BITS + 24 or most >> bezier.LOW_BITS + 27:
                raise Refused(codes.TOO_LONG, joint, most)
            if is_time and most >> TICK_FRACTION_BITS >= LONGEST_TICKS:
                raise Refused(codes.TOO_LONG, joint, most >> TICK_FRACTION_BITS)


class Judge:
    """Judges the parts of one joint; ``value`` says how much where one fails."""

    def __init__(self, parts: "Subintervals", row: "dict[str, int]", gap_ticks: int) -> None:
        self._parts = parts
        self._gap_ticks = gap_ticks
        self._low = row["min_steps"] + bezier.BIAS
        self._high = row["max_steps"] + bezier.BIAS
        self._limit = min(row["max_rate"], MAX_STEP_RATE + MAX_STEP_RATE // 100)
        self._mantissa, self._exponent = rate_check.scaled(self._limit)
        self.value = 0

    def verdict(self, found: int) -> int:
        """A code, _PASS, or _SPLIT where it takes a closer look; ``found``: what ``bring`` gave."""
        parts = self._parts
        for position in (parts.start(), parts.end()):
            if not self._low <= position <= self._high:
                self.value = position - bezier.BIAS
                return codes.OUT_OF_RANGE
        if not parts.angle_local[subdivision.SCALE] or not parts.time_local[subdivision.SCALE]:
            return _SPLIT
        return self._range() or self._rate() or self._abrupt(found)

    def _short(self) -> bool:
        return self._parts.time[5] - self._parts.time[0] < 2 and self._parts.ticks() <= _SHORT_TICKS

    def _range(self) -> int:
        local = self._parts.angle_local
        inside = self._low <= local[subdivision.LOWEST] and local[subdivision.HIGHEST] <= self._high
        return _PASS if inside or self._short() else _SPLIT

    def _rate(self) -> int:
        """|angle'| <= rate * time' for all Bezier points of the derivatives proves it for the part."""
        parts = self._parts
        shift = (
            30
            - self._exponent
            + parts.angle_local[subdivision.SCALE]
            - parts.time_local[subdivision.SCALE]
            + 12
        )
        found = rate_check.compare(parts.angle_local, parts.time_local, self._mantissa, shift)
        if found == rate_check.SLOWER:
            return _PASS
        if found == rate_check.UNDECIDED and not self._short():
            return _SPLIT
        self.value = rate_check.at_ends(parts) if found == rate_check.FASTER else rate_check.highest(parts)
        return codes.TOO_FAST

    def _abrupt(self, found: int) -> int:
        """Where the joint stands still or turns, acceleration may carry it 0.02 steps in half a gap.

        Two opposite steps closer than the gap are left out; acceleration a goes a gap**2 / 8 past a threshold.
        """
        parts = self._parts
        local = parts.angle_local
        if found & subdivision.STRAIGHT:
            return _PASS
        if not found & subdivision.EVEN:
            return _SPLIT
        bend, per = _acceleration(local, parts.time_local)
        if bend * self._gap_ticks**2 * 100 <= per * 16:
            return _PASS
        if not self._short():
            return _SPLIT
        self.value = bend * TICK_HZ * TICK_HZ // per
        return codes.TOO_ABRUPT


def _acceleration(angle: "array[int]", time: "array[int]") -> "tuple[int, int]":
    """A bound of |angle'' / time'**2 - angle' time'' / time'**3| as a fraction of big integers, steps/tick**2."""
    least = time[subdivision.LEAST] - subdivision.DIFFERENCE_BIAS
    most = max(
        abs(angle[subdivision.LEAST] - subdivision.DIFFERENCE_BIAS),
        abs(angle[subdivision.MOST] - subdivision.DIFFERENCE_BIAS),
    )
    bend = 4 * (_second(angle) * least + most * _second(time))
    scale = 2 * (time[subdivision.SCALE] - 12) - angle[subdivision.SCALE]
    per = 5 * least**3
    return (bend << scale, per) if scale >= 0 else (bend, per << -scale)


def _second(local: "array[int]") -> int:
    """Largest second difference of the points."""
    return max([abs(local[subdivision.STEPS + i + 1] - local[subdivision.STEPS + i]) for i in range(4)])
