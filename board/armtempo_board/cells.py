"""The cells of one joint's motion: parts short and straight enough to be solved.

A cell's angle is monotone, its speed and that of time vary by no more than a factor of two, and it lasts at most
2**23 ticks. Parts without a threshold in their hull are passed over whole. No crossing can be missed: the
hull of the Bezier points holds the curve, and differences of one sign prove it monotone.
"""

from armtempo_board.cell import seek
from armtempo_board.parts import Parts

# verdicts, as ``seek`` gives them
NOTHING = 0  # no step so far: go on
CELL = 1  # steps in it, all in one direction
AT_ONCE = 2  # steps at its start
END = 3


class Cells(Parts):
    """Finds the parts that hold steps."""

    def __init__(self) -> None:
        super().__init__()
        self.graze_ticks = 0

    def next(self, position: int) -> int:
        """Look at the next parts; ``position`` (+ points.BIAS) is where the steps so far lead. A verdict."""
        found = seek(self.time, self.angle, self.time_local, self.angle_local, position, self.graze_ticks)
        return NOTHING if found == END and self.page() else found  # a new segment is enough for one call
