"""Memory that is allocated once, in blocks, and divided again for each engine."""

from array import array

import uctypes
from micropython import const

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

_PIECE_WORDS = const(64)


class Memory:
    """``blocks``: 32-bit words of each. Raises MemoryError if the heap has no such block.

    ``address``: of ``words`` words of other memory, which only the processor can access.
    """

    def __init__(self, blocks: "list[int]", address: int = 0, words: int = 0) -> None:
        self._blocks = [_zeros(words) for words in blocks]
        self._taken = [0] * len(blocks)
        self.size = sum(blocks)
        self._address = address
        self._words = words
        self._used = 0

    def release(self) -> None:
        """Take all parts back; they must not be used any more."""
        for number in range(len(self._taken)):
            self._taken[number] = 0
        self._used = 0

    def take_for_processor(self, words: int) -> "memoryview[int]":
        """As ``take``, from the memory that only the processor can access while it has enough.

        On MicroPython the part is not a memoryview (only the heap has those): it has neither length nor slices.
        """
        begin = self._used
        if begin + words > self._words:
            return self.take(words)
        self._used += words
        part: "Any" = uctypes.struct(self._address + 4 * begin, (uctypes.ARRAY, words | uctypes.INT32))
        for word in range(words):
            part[word] = 0
        return part  # type: ignore[no-any-return]

    def take(self, words: int) -> "memoryview[int]":
        """A part of ``words`` signed words, all 0, from the first block with enough; raises MemoryError if
        none has."""
        for number, block in enumerate(self._blocks):
            begin = self._taken[number]
            end = begin + words
            if end <= len(block):
                self._taken[number] = end
                for word in range(begin, end):
                    block[word] = 0
                return memoryview(block)[begin:end]
        raise MemoryError


def bytes_of(part: "Any", first: int, words: int) -> bytearray:
    """The bytes of a part of ``words`` words, from the word ``first`` on."""
    return uctypes.bytearray_at(uctypes.addressof(part) + 4 * first, 4 * (words - first))


def _zeros(words: int) -> "array[int]":
    """An array of zeros, grown in place: made from a buffer, it would need twice the memory."""
    block = array("i")
    for begin in range(0, words, _PIECE_WORDS):
        block.extend(array("i", bytes(4 * min(_PIECE_WORDS, words - begin))))
    return block
