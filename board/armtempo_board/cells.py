"""The cells of one joint's motion in order of time.

Each time segment is halved until a part is a cell that can be solved: angle monotone, its speed and that of
time within a factor of two, at most 2**22 ticks long. Parts without a threshold in their hull are passed
over whole. No crossing can be missed: the hull of the Bezier points holds the curve, and differences of one sign
prove it monotone.
"""

from array import array

from micropython import const

from armtempo_board import cell, points

# verdicts
NOTHING = 0  # no step in this part, or it was split: go on
CELL = 1  # steps in it: see ``heading``
AT_ONCE = 2  # steps at its start
END = 3

_START_LEVEL = const(4)
_DEEPEST = const(27)
_TIME_SCALE = const(18)  # least scale of a cell's time: 2**22 ticks fill 28 bits
_SHORTEST = const(2)  # ticks
_DIFFERENCE_BIAS = const(1 << 29)


class Cells:
    """Walks through the parts of a joint's motion; all buffers are made once."""

    def __init__(self):
        self._raw = array("i", bytes(48))
        self._segment = array("i", bytes(48))
        self._angle_root = array("i", bytes(48))
        self._time_root = array("i", bytes(48))
        self.angle = array("i", bytes(48))
        self.time = array("i", bytes(48))
        self.angle_local = array("i", bytes(4 * cell.LOCAL_SIZE))
        self.time_local = array("i", bytes(4 * cell.LOCAL_SIZE))
        self.heading = 0
        self.graze_ticks = 0

    def load(self, motion, joint, graze_ticks):
        """Stand before the first part. An excursion over a threshold within ``graze_ticks`` may be passed over."""
        self._data = motion.data
        self._weights = points.WEIGHTS[motion.degree]
        self._angle_offset = motion.angle_offset(joint)
        self._time_offset = motion.time_offset(joint)
        self._refine = motion.refine
        self._segments = motion.segments * motion.refine
        self._number = 0
        self._level = _START_LEVEL
        self._index = 0
        self.graze_ticks = graze_ticks
        self._enter()

    def _enter(self):
        """Load the time segment ``_number`` and the part of the angle segment that belongs to it."""
        part = self._number % self._refine
        count = self._weights[0]
        if part == 0:
            offset = self._angle_offset + 8 * (self._number // self._refine)
            points.load(self._data, offset, count, self._raw)
            points.combine(self._raw, self._weights, self._segment)
        points.copy(self._segment, self._angle_root)
        if self._refine > 1:
            points.restrict(self._angle_root, part, self._refine)
        points.load(self._data, self._time_offset + 8 * self._number, count, self._raw)
        points.combine(self._raw, self._weights, self._time_root)

    def next(self, position):
        """Look at the next part; ``position`` (+ points.BIAS) is where the steps so far lead. A verdict."""
        if self._index >> self._level:
            self._number += 1
            if self._number >= self._segments:
                self._number = self._segments
                return END
            self._index = 0
            self._enter()
        points.descend(self._angle_root, self.angle, self._level, self._index)
        points.descend(self._time_root, self.time, self._level, self._index)
        verdict = self._judge(position)
        if verdict < 0:
            self._level += 1
            self._index <<= 1
            return NOTHING
        self._index += 1
        if self._index & 1 == 0 and self._level > 0 and not self._index >> self._level:
            self._index >>= 1
            self._level -= 1
        return verdict

    def _judge(self, position):
        local = self.angle_local
        cell.localise(self.angle, local)
        if local[8] == local[9]:
            if local[8] == position:
                return NOTHING
            cell.localise(self.time, self.time_local)
            return AT_ONCE if self.time_local[0] else -1
        cell.localise(self.time, self.time_local)
        if self.time_local[0] < _TIME_SCALE:
            return -1
        self.heading = heading(local)
        if self.heading and heading(self.time_local) > 0:
            return CELL
        ticks = self.ticks()
        if ticks <= self.graze_ticks and self.start() == self.end() == position:
            return NOTHING
        return AT_ONCE if ticks <= _SHORTEST or self._level >= _DEEPEST else -1

    def start(self):
        """Position (+ points.BIAS) at the start of the part."""
        return self.angle[0] + (self.angle[6] >> 27)

    def end(self):
        """Position (+ points.BIAS) at the end of the part."""
        return self.angle[5] + (self.angle[11] >> 27)

    def ticks(self):
        """Length of a part that is no longer than 2**28 ticks."""
        return ((self.time[5] - self.time[0]) << 12) + ((self.time[11] - self.time[6]) >> 16)


def heading(local):
    """1 or -1 where all differences are of that sign and within a factor of two; otherwise 0."""
    if not local[0]:
        return 0
    least = local[6] - _DIFFERENCE_BIAS
    most = local[7] - _DIFFERENCE_BIAS
    if least > 0 and most <= 2 * least:
        return 1
    if most < 0 and least >= 2 * most:
        return -1
    return 0
