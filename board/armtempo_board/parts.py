"""The parts of one joint's motion in order of time: time segments, halved as often as asked."""

from array import array

from micropython import const

from armtempo_board import cell, points

TYPE_CHECKING = False
if TYPE_CHECKING:
    from armtempo_shared.motion import Motion

_START_LEVEL = const(4)
_KEPT = const(3)  # levels between the part and the piece it is halved from


class Parts:
    """Walks through a joint's motion part by part; all buffers are made once.

    ``angle`` and ``time`` are the part's pieces (points.py), ``angle_local`` and ``time_local`` their measures.
    """

    def __init__(self) -> None:
        self._raw = array("i", bytes(48))
        self._segment = array("i", bytes(48))
        self._angle_root = array("i", bytes(48))
        self._time_root = array("i", bytes(48))
        self._angle_base = array("i", bytes(48))
        self._time_base = array("i", bytes(48))
        self.angle = array("i", bytes(48))
        self.time = array("i", bytes(48))
        self.angle_local = array("i", bytes(4 * cell.LOCAL_SIZE))
        self.time_local = array("i", bytes(4 * cell.LOCAL_SIZE))
        self.level = 0

    def load(self, motion: "Motion", joint: int) -> None:
        """Stand before the first part."""
        self._data = motion.data
        self._weights = points.weights(motion.degree)
        self._angle_offset = motion.angle_offset(joint)
        self._time_offset = motion.time_offset(joint)
        self._refine = motion.refine
        self._segments = motion.segments * motion.refine
        self._number = 0
        self.level = _START_LEVEL
        self._index = 0
        self._enter()

    def _enter(self) -> None:
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
        self._base_level = -1
        self._base_index = 0

    def page(self) -> bool:
        """Go on to the next segment where the last part ended one; True where it did."""
        if not self._index >> self.level or self._number + 1 >= self._segments:
            return False
        self._number += 1
        self._index = 0
        self._enter()
        return True

    def bring(self) -> bool:
        """Compute the part; False: past the end."""
        if self._index >> self.level and not self.page():
            return False
        below = self.level - self._base_level
        if self._base_level < 0 or below < 0 or self._index >> below != self._base_index:
            below = min(self.level, _KEPT)
            self._base_level = self.level - below
            self._base_index = self._index >> below
            points.descend(self._angle_root, self._angle_base, self._base_level, self._base_index)
            points.descend(self._time_root, self._time_base, self._base_level, self._base_index)
        index = self._index & ((1 << below) - 1)
        points.descend(self._angle_base, self.angle, below, index)
        points.descend(self._time_base, self.time, below, index)
        return True

    def split(self) -> None:
        """Go on with the first half of the part."""
        self.level += 1
        self._index <<= 1

    def skip(self) -> None:
        """Go on behind the part, with one twice as long where the grid allows it."""
        self._index += 1
        if self._index & 1 == 0 and self.level > 0 and not self._index >> self.level:
            self._index >>= 1
            self.level -= 1

    def start(self) -> int:
        """Position (+ points.BIAS) at the start of the part."""
        return self.angle[0] + (self.angle[6] >> 27)

    def end(self) -> int:
        """Position (+ points.BIAS) at the end of the part."""
        return self.angle[5] + (self.angle[11] >> 27)

    def ticks(self) -> int:
        """Length of a part that is no longer than 2**28 ticks."""
        return ((self.time[5] - self.time[0]) << 12) + ((self.time[11] - self.time[6]) >> 16)
