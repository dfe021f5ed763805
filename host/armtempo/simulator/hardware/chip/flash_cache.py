"""The sectors of the chip's flash under the file system, and the one that MicroPython keeps in memory.

As ``ports/stm32/flashbdev.c``: a block that is written goes to the cache; the sector in it is erased and programmed
whole when another sector is written, or when the file system asks for it.
"""

FIRST_SECTOR = 1
SECTOR_BLOCKS = (32, 32, 32, 128)
"""Blocks of 512 bytes of sectors 1 to 4."""
_ERASE_MS = (250, 250, 250, 550)
_WORD_MS = 0.016
"""Typical times of the data sheet (DS8626, voltage range 3): to erase a sector, to program a word."""
_WORDS_OF_BLOCK = 128
_NONE = -1


class FlashCache:
    """``erased(sector, ms)`` is called when a sector is written, which takes ``ms``."""

    def __init__(self, erased):
        self._erased = erased
        self._index = _NONE
        self._is_dirty = False

    def write(self, block):
        """A block is written."""
        index = 0
        while index < len(SECTOR_BLOCKS) - 1 and block >= SECTOR_BLOCKS[index]:
            block -= SECTOR_BLOCKS[index]
            index += 1
        if index != self._index:
            self.flush()
            self._index = index
        self._is_dirty = True

    def flush(self):
        """Write the sector, if it has changed."""
        if self._is_dirty:
            self._is_dirty = False
            words = SECTOR_BLOCKS[self._index] * _WORDS_OF_BLOCK
            self._erased(FIRST_SECTOR + self._index, _ERASE_MS[self._index] + words * _WORD_MS)
