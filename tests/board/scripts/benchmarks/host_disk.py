"""A disk on the emulated chip, whose flash cannot be written: a file of the host, by semihosting.

It takes the place of the folder of the store. Small, as it shares the chip's heap with the program. Where the chip
would erase and write a sector, it prints which, and waits as long.
"""

import os
from array import array

import micropython
import pyb
import uctypes
from flash_cache import FlashCache

_OPEN, _WRITE, _READ, _SEEK = 1, 5, 6, 10
_READ_AND_WRITE = 3  # "r+b"
_BLOCK = 512
_FLUSH = 3  # MicroPython's MP_BLOCKDEV_IOCTL_SYNC


@micropython.asm_thumb
def _ask(r0, r1):
    data(2, 0xBEAB)  # noqa: F821  BKPT 0xAB


class Disk:
    """The blocks of a file."""

    def __init__(self, name, blocks):
        self._blocks = blocks
        self._words = array("i", [uctypes.addressof(name), _READ_AND_WRITE, len(name)])
        self._handle = _ask(_OPEN, self._words)
        self._cache = FlashCache(erased)

    def _move(self, what, block, buffer):
        words = self._words
        words[0], words[1] = self._handle, _BLOCK * block
        _ask(_SEEK, words)
        words[1], words[2] = uctypes.addressof(buffer), len(buffer)
        _ask(what, words)

    def readblocks(self, block, buffer):
        """As MicroPython wants it."""
        self._move(_READ, block, buffer)

    def writeblocks(self, block, buffer):
        """The same."""
        for more in range(len(buffer) // _BLOCK):
            self._cache.write(block + more)
        self._move(_WRITE, block, buffer)

    def ioctl(self, what, argument):
        """Flush; number and size of the blocks."""
        if what == _FLUSH:
            self._cache.flush()
        return self._blocks if what == 4 else _BLOCK if what == 5 else 0


def erased(sector, ms):
    """The chip stands still."""
    print("@ erased", sector)
    pyb.delay(int(ms))


def mount(folder, blocks):
    """Mount the host's file "disk" there; where it is empty it gets a file system."""
    disk = Disk(b"disk", blocks)
    os.chdir("/")
    os.umount("/flash")
    try:
        os.mount(disk, folder)
    except OSError:
        os.VfsFat.mkfs(disk)
        os.mount(disk, folder)
    os.mount(pyb.Flash(start=0), "/flash")
    os.chdir("/flash")
