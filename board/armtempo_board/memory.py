"""Memory that is taken once, in one piece, and handed out in parts again and again."""

from array import array

from micropython import const

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

_PIECE_WORDS = const(64)


class Memory:
    """``words``: so many, of 32 bits. MemoryError where the heap has them not in one piece."""

    def __init__(self, words: int) -> None:
        self._words = array("i")
        for begin in range(0, words, _PIECE_WORDS):  # it grows in place: made of a buffer, it would take its size twice
            self._words.extend(array("i", bytes(4 * min(_PIECE_WORDS, words - begin))))
        self.size = words
        self._taken = 0

    def release(self) -> None:
        """Take all parts back; who has one uses it no more."""
        self._taken = 0

    def take(self, words: int) -> "Any":
        """A part of so many words, signed, all 0."""
        begin = self._taken
        self._taken += words
        if self._taken > self.size:
            raise MemoryError
        for word in range(begin, self._taken):
            self._words[word] = 0
        return memoryview(self._words)[begin : self._taken]
