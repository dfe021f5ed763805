"""The board program's ``uctypes``: the interpreter's own; remembers the buffers that DMA can use."""

import uctypes as _own
from chip import memory
from uctypes import *  # noqa: F403


def addressof(buffer):
    """Address of a buffer, at which DMA streams find it."""
    where = _own.addressof(buffer)
    memory.objects[where & memory.MASK] = buffer
    return where


def bytearray_at(where, size):
    """The memory at an address of this process, or of the flash on the chip."""
    return _own.bytearray_at(memory.real(where), size)
