"""The subintervals of one joint's motion in order of time: time segments, halved as often as asked.

A subinterval that holds steps is halved until Newton's method is safe in it: its angle is monotone, its speed and
that of time vary by no more than a factor of two, and it lasts at most 2**23 ticks. One without a half step in the
convex hull of its Bezier points holds no step and is passed over whole. So no step is missed: the hull holds the
curve, and differences of one sign prove it monotone.
"""

from array import array

from micropython import const

from armtempo_board.stepgen import bezier, subdivision
from armtempo_board.stepgen.subdivision import seek

TYPE_CHECKING = False
if TYPE_CHECKING:
    from armtempo_shared.motion import Motion

# results of a search, as ``subdivision.seek`` gives them
NOT_YET = 0  # no step so far: go on
MONOTONE = 1  # steps in it, all in one direction
AT_START = 2  # steps, all of them at its start
END = 3

_START_LEVEL = const(4)


class Subintervals:
    """Walks through a joint's motion; all buffers are made once.

    ``angle`` and ``time`` begin with the Bezier points of the subinterval (bezier.py); ``angle_local`` and
    ``time_local`` are what was measured of them (subdivision.py). ``reversal_ticks``: a subinterval that is as short
    and comes back to where it began is passed over.
    """

    def __init__(self) -> None:
        self.angle = array("i", bytes(4 * subdivision.PIECES_SIZE))
        self.time = array("i", bytes(4 * subdivision.PIECES_SIZE))
        self.angle_local = array("i", bytes(4 * subdivision.LOCAL_SIZE))
        self.time_local = array("i", bytes(4 * subdivision.LOCAL_SIZE))
        self.reversal_ticks = 0

    def load(self, motion: "Motion", joint: int) -> None:
        """Stand before the first subinterval."""
        self._data = motion.data
        self._weights = bezier.weights(motion.degree)
        self._angle_offset = motion.angle_offset(joint) >> 2
        self._time_offset = motion.time_offset(joint) >> 2
        self._refine = motion.refine
        self._segments = motion.segments * motion.refine
        self._number = -1
        self.angle_local[subdivision.LEVEL] = _START_LEVEL
        self.time_local[subdivision.NODE] = 1 << _START_LEVEL
        self.time_local[subdivision.MOVE] = subdivision.STAY
        self.load_segment()

    def load_segment(self) -> bool:
        """Load the next time segment and the part of the angle segment that belongs to it; False: there is none."""
        number = self._number + 1
        if number == self._segments:
            return False
        self._number = number
        offset = self._angle_offset + 2 * (number // self._refine)
        bezier.load(self._data, offset, self._weights, self.angle)
        bezier.restrict(self.angle, number % self._refine, self._refine)
        bezier.load(self._data, self._time_offset + 2 * number, self._weights, self.time)
        bezier.restrict(self.time, 0, 1)
        return True

    def search(self, position: int) -> int:
        """Look for steps in the next subintervals; one of the results above.

        ``position`` (+ bezier.BIAS) is where the steps so far lead.
        """
        found = seek(self.time, self.angle, self.time_local, self.angle_local, position, self.reversal_ticks)
        # a new segment is enough for one call
        return NOT_YET if found == END and self.load_segment() else found

    def measure(self) -> int:
        """Compute and measure the subinterval; 0: past the end, else 1 + what is known of it (subdivision.py)."""
        found = 0
        while not found:
            found = seek(self.time, self.angle, self.time_local, self.angle_local, 0, 0) >> 2
            if not found and not self.load_segment():
                break
        return found

    def split(self) -> None:
        """Go on with its first half."""
        self.time_local[subdivision.MOVE] = subdivision.SPLIT

    def skip(self) -> None:
        """Go on behind it, with one twice as long where the grid allows it."""
        self.time_local[subdivision.MOVE] = subdivision.SKIP

    def start(self) -> int:
        """Position (+ bezier.BIAS) at its start."""
        return self.angle[0] + (self.angle[6] >> 27)

    def end(self) -> int:
        """Position (+ bezier.BIAS) at its end."""
        return self.angle[5] + (self.angle[11] >> 27)

    def ticks(self) -> int:
        """Its length, where that is no more than 2**28 ticks."""
        return ((self.time[5] - self.time[0]) << 12) + ((self.time[11] - self.time[6]) >> 16)
