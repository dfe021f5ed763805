"""A disk on the emulated chip, whose flash cannot be written: a file of the host, by semihosting.

It takes the place of the folder of the store. Small, as it shares the chip's heap with the program.
"""

import os
from array import array

import micropython
import pyb
import uctypes

_OPEN, _WRITE, _READ, _SEEK = 1, 5, 6, 10
_READ_AND_WRITE = 3  # "r+b"
_BLOCK = 512


@micropython.asm_thumb
def _ask(r0, r1):
    data(2, 0xBEAB)  # noqa: F821  BKPT 0xAB


class Disk:
    """The blocks of a file."""

    def __init__(self, name, blocks):
        self._blocks = blocks
        self._words = array("i", [uctypes.addressof(name), _READ_AND_WRITE, len(name)])
        self._handle = _ask(_OPEN, self._words)

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
        self._move(_WRITE, block, buffer)

    def ioctl(self, what, argument):
        """Number and size of the blocks."""
        return self._blocks if what == 4 else _BLOCK if what == 5 else 0


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
