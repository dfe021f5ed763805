"""Memory for the engine, made once and reused for each arm, so that the heap does not fragment."""

import uctypes
from armtempo_shared.engine_memory import (
    LARGEST_BYTES,
    PROCESSOR_WORDS,
    SHORT_MS,
    blocks,
    lasting_ms,
    ring_words,
)

from armtempo_board.hardware.sampler import Sampler
from armtempo_board.memory import Memory
from armtempo_board.motion.ring_feeder import RingFeeder

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any


class EngineMemory:
    """``size``: bytes for an engine, see ``armtempo_shared.engine_memory``; ``memory`` is made by ``make_memory``.

    ``address``: of its PROCESSOR_WORDS; 0: in the heap. It owns the interrupts' callbacks, so they never
    refer to objects of an earlier engine.
    """

    def __init__(self, size: int, address: int = 0) -> None:
        self.size = size
        self.is_short = size < LARGEST_BYTES  # the heap does not have enough for every arm
        self._own = None if address else Memory([PROCESSOR_WORDS]).take(PROCESSOR_WORDS)
        self._address = address or uctypes.addressof(self._own)
        self.memory = Memory([])
        self.sampler = Sampler()
        self.feeder = RingFeeder(self.sampler.block)

    def make_memory(self, words: int) -> None:
        """Allocate blocks of ``words`` words; raises MemoryError if the heap has no such block."""
        self.memory = Memory([])  # what was there goes first
        self.memory = Memory(blocks(words), self._address, PROCESSOR_WORDS)

    def rings(self, rates: "list[int]") -> "list[Any]":
        """Take all memory back, then allocate a ring for each of these step rates, the largest first."""
        self.memory.release()
        lasts_ms = lasting_ms(rates, self.memory.size) or SHORT_MS
        sizes = [ring_words(rate, lasts_ms) for rate in rates]
        found: "dict[int, Any]" = {}
        for joint in sorted(range(len(sizes)), key=lambda joint: -sizes[joint]):
            found[joint] = self.memory.take(sizes[joint])
        return [found[joint] for joint in range(len(sizes))]
