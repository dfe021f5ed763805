"""The cells of one joint's motion: parts short and straight enough to be solved.

A cell's angle is monotone, its speed and that of time vary by no more than a factor of two, and it lasts at most
2**23 ticks. Parts without a threshold in their hull are passed over whole. No crossing can be missed: the
hull of the Bezier points holds the curve, and differences of one sign prove it monotone.
"""

from micropython import const

from armtempo_board import cell
from armtempo_board.parts import Parts

# verdicts
NOTHING = 0  # no step in this part, or it was split: go on
CELL = 1  # steps in it: see ``heading``
AT_ONCE = 2  # steps at its start
END = 3

_DEEPEST = const(27)
_TIME_SCALE = const(17)  # least scale of a cell's time: 2**23 ticks fill 28 bits
_SHORTEST = const(2)  # ticks


class Cells(Parts):
    """Finds the parts that hold steps."""

    def __init__(self) -> None:
        super().__init__()
        self.heading = 0
        self.graze_ticks = 0

    def next(self, position: int) -> int:
        """Look at the next part; ``position`` (+ points.BIAS) is where the steps so far lead. A verdict."""
        if self.page():
            return NOTHING  # enough for one call
        if not self.bring():
            return END
        verdict = self._judge(position)
        if verdict >= 0:
            self.skip()
            return verdict
        self.split()
        return NOTHING

    def _judge(self, position: int) -> int:
        local = self.angle_local
        self.heading = cell.localise(self.angle, local)
        even = cell.localise(self.time, self.time_local)
        if local[cell.LOWEST] == local[cell.HIGHEST]:
            if local[cell.LOWEST] == position:
                return NOTHING
            return AT_ONCE if self.time_local[cell.SCALE] else -1
        if self.time_local[cell.SCALE] < _TIME_SCALE:
            return -1
        if self.heading and even > 0:
            return CELL
        ticks = self.ticks()
        if ticks <= self.graze_ticks and self.start() == self.end() == position:
            return NOTHING
        return AT_ONCE if ticks <= _SHORTEST or self.level >= _DEEPEST else -1
