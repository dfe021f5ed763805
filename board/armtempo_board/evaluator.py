"""The evaluator: from a motion record to step times. What the rest of the board program uses of it,
besides ``check``, which is imported only before a start.

Motion ─ Cells (parts that can be solved) ─ Walker (steps of a joint) ─ edge times in the ring
"""

from armtempo_board.ends import duration_ticks, start_offset
from armtempo_board.walker import Walker

__all__ = ["Walker", "duration_ticks", "start_offset"]
