"""What one engine after the other works in, made once: the heap is as it was when an arm gives way to another."""

from armtempo_board.hardware.sampler import Sampler
from armtempo_board.memory import Memory
from armtempo_board.motion.ring_feeder import RingFeeder


class Workspace:
    """``words``: of memory for step generators and rings (``armtempo_shared.engine_memory``).

    The interrupts' callbacks belong to it, so they never hold what an engine had before.
    """

    def __init__(self, words: int) -> None:
        self.memory = Memory(words)
        self.sampler = Sampler()
        self.feeder = RingFeeder(self.sampler.block)
