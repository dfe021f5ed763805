"""The subintervals of one joint's motion in order of time: time segments, halved as often as asked.

A subinterval that holds steps is halved until Newton's method is safe in it: its angle is monotone, its speed and
that of time vary by no more than a factor of two, and it lasts at most 2**23 ticks. One without a half step in the
convex hull of its Bezier points holds no step and is passed over whole. So no step is missed: the hull holds the
curve, and differences of one sign prove it monotone.
"""

from micropython import const

from armtempo_board.memory import Memory
from armtempo_board.stepgen import bezier, subdivision
from armtempo_board.stepgen.control_points import WINDOW_WORDS, ControlPoints
from armtempo_board.stepgen.subdivision import MEASURES_SIZE, PIECES_SIZE, search

TYPE_CHECKING = False
if TYPE_CHECKING:
    from armtempo_shared.motion import MotionHead

# arrays of a subinterval
ANGLE = const(0)
TIME = const(1)
ANGLE_MEASURES = const(2)
TIME_MEASURES = const(3)

_START_LEVEL = const(4)
# what was found, as subdivision.py says it
_NOT_YET = const(0)
_END = const(3)


class Subintervals:
    """Walks through a joint's motion.

    ``angle`` and ``time`` begin with the Bezier points of the subinterval (bezier.py); ``angle_measures`` and
    ``time_measures`` are what was measured of them (subdivision.py); ``arrays`` holds all four, in the order of the
    words above. ``points``: the control points of angle, free for others before ``load``. ``min_ticks``: a subinterval
    no longer than this that comes back to the position where it began is passed over.
    """

    def __init__(self, memory: Memory) -> None:
        """``memory``: where its words are taken from (``armtempo_shared.engine_memory`` counts them)."""
        take = memory.take_for_processor
        self.angle = take(PIECES_SIZE)
        self.time = take(PIECES_SIZE)
        self.points = ControlPoints(take(WINDOW_WORDS))
        self._time_points = ControlPoints(take(WINDOW_WORDS))
        self.angle_measures = take(MEASURES_SIZE)
        self.time_measures = take(MEASURES_SIZE)
        self.arrays = self.angle, self.time, self.angle_measures, self.time_measures
        self.min_ticks = 0

    def load(self, motion: "MotionHead", joint: int) -> None:
        """Stand before the first subinterval."""
        self.points.open(motion.stream(motion.angle_offset(joint)), motion.degree)
        self._time_points.open(motion.stream(motion.time_offset(joint)), motion.degree)
        self._weights = bezier.weights(motion.degree)
        self._refine = motion.refine
        self._segments = motion.segments * motion.refine
        self._number = -1
        self.angle_measures[subdivision.LEVEL] = _START_LEVEL
        self.time_measures[subdivision.NODE] = 1 << _START_LEVEL
        self.time_measures[subdivision.MOVE] = subdivision.STAY
        self.load_segment()

    def close(self) -> None:
        """The motion is read no further."""
        self.points.close()
        self._time_points.close()

    def load_segment(self) -> bool:
        """Load the next time segment and the part of the angle segment that belongs to it; False: there is none."""
        number = self._number + 1
        if number == self._segments:
            return False
        self._number = number
        points = self.points
        bezier.from_control_points(
            points.words, points.seek(number // self._refine), self._weights, self.angle
        )
        bezier.restrict(self.angle, number % self._refine, self._refine)
        points = self._time_points
        bezier.from_control_points(points.words, points.seek(number), self._weights, self.time)
        bezier.restrict(self.time, 0, 1)
        return True

    def search(self, steps: int) -> int:
        """Look for steps in the next subintervals; see subdivision.py.

        ``steps`` (+ bezier.BIAS): the position to which the steps so far lead.
        """
        found = search(self.time, self.angle, self.time_measures, self.angle_measures, steps, self.min_ticks)
        if found == _END and self.load_segment():
            found = _NOT_YET  # a new segment is enough for one call
        return found

    def end_steps(self) -> int:
        """Where the subinterval ends, in whole steps."""
        end: int = self.angle[bezier.LAST_HIGH] + (self.angle[bezier.LAST_LOW] >> 27) - bezier.BIAS
        return end

    def measure(self) -> int:
        """Compute and measure the subinterval; 0: past the end, else MEASURED and its other results."""
        found = 0
        while not found:
            found = search(self.time, self.angle, self.time_measures, self.angle_measures, 0, 0) >> 2
            if not found and not self.load_segment():
                break
        return found

    def advance(self, move: int) -> None:
        """With its first half (subdivision.SPLIT), or after it (SKIP)."""
        self.time_measures[subdivision.MOVE] = move
