"""The evaluator: from a motion record to step times. What the rest of the board program uses of it.

    Motion ─ Cells (parts that can be solved) ─ Walker (steps of a joint) ─ edge times in the ring
"""

from armtempo_board import points
from armtempo_board.check import check
from armtempo_board.walker import Walker
from armtempo_shared import limits
from armtempo_shared.motion import Motion

__all__ = ["Walker", "check", "duration_ticks"]


def duration_ticks(motion: Motion) -> int:
    """Ticks from the start to where the last joint comes to rest, rounded up."""
    longest = 0
    for joint in range(1 if motion.shared else motion.joints):
        last = motion.time_offset(joint) + 8 * (motion.segments * motion.refine - 1)
        longest = max(longest, points.last_value(motion, last))
    return -(-longest >> limits.TICK_FRACTION_BITS)
