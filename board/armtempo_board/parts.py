"""The parts of one joint's motion in order of time: time segments, halved as often as asked."""

from array import array

from micropython import const

from armtempo_board import cell, points

TYPE_CHECKING = False
if TYPE_CHECKING:
    from armtempo_shared.motion import Motion

_START_LEVEL = const(4)


class Parts:
    """Walks through a joint's motion part by part; all buffers are made once.

    ``angle`` and ``time`` begin with the part's pieces (points.py); ``angle_local`` and ``time_local`` are their
    measures (cell.py).
    """

    def __init__(self) -> None:
        self.angle = array("i", bytes(4 * cell.PIECES_SIZE))
        self.time = array("i", bytes(4 * cell.PIECES_SIZE))
        self.angle_local = array("i", bytes(4 * cell.LOCAL_SIZE))
        self.time_local = array("i", bytes(4 * cell.LOCAL_SIZE))

    def load(self, motion: "Motion", joint: int) -> None:
        """Stand before the first part."""
        self._data = motion.data
        self._weights = points.weights(motion.degree)
        self._angle_offset = motion.angle_offset(joint) >> 2
        self._time_offset = motion.time_offset(joint) >> 2
        self._refine = motion.refine
        self._segments = motion.segments * motion.refine
        self._number = -1
        self.angle_local[cell.LEVEL] = _START_LEVEL
        self.time_local[cell.NODE] = 1 << _START_LEVEL
        self.time_local[cell.MOVE] = cell.STAY
        self.page()

    def page(self) -> bool:
        """Load the next time segment and the part of the angle segment that belongs to it; False: there is none."""
        number = self._number + 1
        if number == self._segments:
            return False
        self._number = number
        offset = self._angle_offset + 2 * (number // self._refine)
        points.load(self._data, offset, self._weights, self.angle)
        points.restrict(self.angle, number % self._refine, self._refine)
        points.load(self._data, self._time_offset + 2 * number, self._weights, self.time)
        points.restrict(self.time, 0, 1)
        return True

    def bring(self) -> int:
        """Compute and measure the part; 0: past the end, otherwise 1 + what is known of it (cell.py)."""
        found = 0
        while not found:
            found = cell.seek(self.time, self.angle, self.time_local, self.angle_local, 0, 0) >> 2
            if not found and not self.page():
                break
        return found

    def split(self) -> None:
        """Go on with the first half of the part."""
        self.time_local[cell.MOVE] = cell.SPLIT

    def skip(self) -> None:
        """Go on behind the part, with one twice as long where the grid allows it."""
        self.time_local[cell.MOVE] = cell.SKIP

    def start(self) -> int:
        """Position (+ points.BIAS) at the start of the part."""
        return self.angle[0] + (self.angle[6] >> 27)

    def end(self) -> int:
        """Position (+ points.BIAS) at the end of the part."""
        return self.angle[5] + (self.angle[11] >> 27)

    def ticks(self) -> int:
        """Length of a part that is no longer than 2**28 ticks."""
        return ((self.time[5] - self.time[0]) << 12) + ((self.time[11] - self.time[6]) >> 16)
