"""Is a motion fit to be run? Judged by the board itself before each start.

Whole segments are judged by the hulls of their polynomials, and halved where that does not decide: what
passes is proven, not sampled.
"""

import struct

from armtempo_shared import codes
from armtempo_shared.limits import LONGEST_TICKS, MAX_STEP_RATE, TICK_FRACTION_BITS, TICK_HZ
from micropython import const

from armtempo_board import cell, points, rates
from armtempo_board.parts import Parts

TYPE_CHECKING = False
if TYPE_CHECKING:
    from array import array

    from armtempo_shared.motion import Motion

GAP_TICKS = const(25200)
"""Least time between opposite steps that is reckoned with where none is given: 0.3 ms."""

_SHORT_TICKS = const(1024)
_PASS = const(0)
_SPLIT = const(-1)


def check(
    motion: "Motion",
    joints: "list[dict[str, int]]",
    gap_ticks: int = GAP_TICKS,
    parts: "Parts | None" = None,
) -> "tuple[int, int, int] | None":
    """None, or (code, joint, value) of the first thing wrong.

    ``joints``: the joints' rows of the arm record; ``gap_ticks``: see ``Walker.load``. ``parts``: lent for
    the walk through the motion, for the sake of the heap.
    ``value`` is, by code: time_order, the control point;
    too_long, ticks or steps of 2**28; out_of_range, the position in steps; too_fast, steps/s;
    too_abrupt, steps/s**2.
    """
    parts = parts or Parts()
    for joint in range(motion.joints):
        wrong = _numbers(motion, joint)
        if wrong:
            return wrong[0], joint, wrong[1]
        parts.load(motion, joint)
        judge = Judge(parts, joints[joint], gap_ticks)
        while found := parts.bring():
            code = judge.verdict(found)
            if code == _SPLIT:
                parts.split()
            elif code:
                return code, joint, judge.value
            else:
                parts.skip()
    return rates.check_sum(motion, joints, parts)


def _numbers(motion: "Motion", joint: int) -> "tuple[int, int] | None":
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
                        return codes.TIME_ORDER, segment + i + 1
            span = max(control) - min(control)
            most = max(max(control), -min(control))
            if span >> points.LOW_BITS + 24 or most >> points.LOW_BITS + 27:
                return codes.TOO_LONG, most
            if is_time and most >> TICK_FRACTION_BITS >= LONGEST_TICKS:
                return codes.TOO_LONG, most >> TICK_FRACTION_BITS
    return None


class Judge:
    """Judges the parts of one joint; ``value`` says how much where one fails."""

    def __init__(self, parts: "Parts", row: "dict[str, int]", gap_ticks: int) -> None:
        self._parts = parts
        self._gap_ticks = gap_ticks
        self._low = row["min_steps"] + points.BIAS
        self._high = row["max_steps"] + points.BIAS
        self._limit = min(row["max_rate"], MAX_STEP_RATE + MAX_STEP_RATE // 100)
        self._mantissa, self._exponent = rates.scaled(self._limit)
        self.value = 0

    def verdict(self, found: int) -> int:
        """A code, _PASS, or _SPLIT where it takes a closer look; ``found``: what ``bring`` gave."""
        parts = self._parts
        for position in (parts.start(), parts.end()):
            if not self._low <= position <= self._high:
                self.value = position - points.BIAS
                return codes.OUT_OF_RANGE
        if not parts.angle_local[cell.SCALE] or not parts.time_local[cell.SCALE]:
            return _SPLIT
        return self._range() or self._rate() or self._abrupt(found)

    def _short(self) -> bool:
        return self._parts.time[5] - self._parts.time[0] < 2 and self._parts.ticks() <= _SHORT_TICKS

    def _range(self) -> int:
        local = self._parts.angle_local
        inside = self._low <= local[cell.LOWEST] and local[cell.HIGHEST] <= self._high
        return _PASS if inside or self._short() else _SPLIT

    def _rate(self) -> int:
        """|angle'| <= rate * time' for all Bezier points of the derivatives proves it for the part."""
        parts = self._parts
        shift = 30 - self._exponent + parts.angle_local[cell.SCALE] - parts.time_local[cell.SCALE] + 12
        found = rates.compare(parts.angle_local, parts.time_local, self._mantissa, shift)
        if found == rates.SLOWER:
            return _PASS
        if found == rates.UNDECIDED and not self._short():
            return _SPLIT
        self.value = rates.at_ends(parts) if found == rates.FASTER else rates.highest(parts)
        return codes.TOO_FAST

    def _abrupt(self, found: int) -> int:
        """Where the joint stands still or turns, acceleration may carry it 0.02 steps in half a gap.

        Two opposite steps closer than the gap are left out; acceleration a goes a gap**2 / 8 past a threshold.
        """
        parts = self._parts
        local = parts.angle_local
        if found & cell.STRAIGHT:
            return _PASS
        if not found & cell.EVEN:
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
    least = time[cell.LEAST] - cell.DIFFERENCE_BIAS
    most = max(
        abs(angle[cell.LEAST] - cell.DIFFERENCE_BIAS),
        abs(angle[cell.MOST] - cell.DIFFERENCE_BIAS),
    )
    bend = 4 * (_second(angle) * least + most * _second(time))
    scale = 2 * (time[cell.SCALE] - 12) - angle[cell.SCALE]
    per = 5 * least**3
    return (bend << scale, per) if scale >= 0 else (bend, per << -scale)


def _second(local: "array[int]") -> int:
    """Largest second difference of the points."""
    return max([abs(local[cell.STEPS + i + 1] - local[cell.STEPS + i]) for i in range(4)])
