"""The last two sectors of the chip's flash, which hold no files, and the registers by which they are written.

RM0090 3.5 to 3.9: keys unlock CR, an erased bit can only be cleared. They last in a file next to the flash's folder.
"""

import os

from chip import memory
from chip.flash import exists, real_open

_KEYR, _SR, _CR = 1, 3, 4  # words of FLASH
_KEYS = 0x45670123, 0xCDEF89AB
_FIRST = 10
_PG, _SER, _STRT, _LOCK = 1 << 0, 1 << 1, 1 << 16, 1 << 31
_SNB, _PSIZE, _WORDS = 3, 8, 2  # places in CR; PSIZE for words
_ERRORS = 1 << 7  # SR: PGSERR
_ERASE_MS, _WRITE_MS = 1000, 16  # of a sector of 128 KB, of a piece
_PIECE = 1024  # words that are one operation of the flash
_BLANK = b"\xff" * _PIECE


class Sectors:
    """``flash``: the folder's; its operations are counted, and the power may fail in each."""

    def __init__(self, flash, path):
        self._flash = flash
        self._path = path
        self._keys = 0
        self._written = 0
        _fill(0, memory.SECTORS_BYTES)
        if exists(path):
            with real_open(path, "rb") as file:
                file.readinto(memory.raw_sectors)
        self._at = memory.index("FLASH")
        memory.poke(self._at + _CR, _LOCK)

    def sync(self):
        """The registers were written."""
        key, control = memory.words[self._at + _KEYR], memory.words[self._at + _CR]
        memory.poke(self._at + _KEYR, 0)
        if memory.seen[self._at + _CR] & _LOCK:
            if key:
                self._keys = self._keys + 1 if self._keys < 2 and key == _KEYS[self._keys] else 3
            memory.poke(self._at + _CR, 0 if self._keys == 2 else _LOCK)
            return
        memory.poke(self._at + _SR, 0)
        memory.poke(self._at + _CR, control & ~_STRT)
        if control & _STRT and control & _SER:
            number = control >> _SNB & 15
            if number < _FIRST or number > _FIRST + 1:
                raise ValueError("the virtual board has no sector %d" % number)
            self._erase((number - _FIRST) * memory.SECTOR_BYTES)
        if control & _LOCK:
            self._keys = 0
            self._save()

    def _erase(self, begin):
        fails = self._flash.operation()
        self._flash.erased(_FIRST + begin // memory.SECTOR_BYTES, _ERASE_MS)
        _fill(begin, memory.SECTOR_BYTES // 2 if fails else memory.SECTOR_BYTES)
        if fails:
            self._save()
            self._flash.power_fails()

    def program(self, at, value):
        """A word was written."""
        control = memory.words[self._at + _CR]
        if control & _LOCK or not control & _PG or control >> _PSIZE & 3 != _WORDS:
            memory.poke(self._at + _SR, _ERRORS)
            return
        self._written += 1
        if self._written % _PIECE == 0:
            self._flash.stall(_WRITE_MS)
            if self._flash.operation():
                self._save()
                self._flash.power_fails()
        memory.sectors[at] &= value & memory.MASK

    def _save(self):
        if not _is_blank():
            with real_open(self._path, "wb") as file:
                file.write(memory.raw_sectors)
        elif exists(self._path):
            os.remove(self._path)


def _fill(begin, count):
    """What is erased has all bits set; in pieces, as a heap may be small."""
    for at in range(begin, begin + count, _PIECE):
        memory.raw_sectors[at : at + _PIECE] = _BLANK


def _is_blank():
    return all(
        [memory.raw_sectors[at : at + _PIECE] == _BLANK for at in range(0, memory.SECTORS_BYTES, _PIECE)]
    )
