"""The board program's ``uctypes``: the interpreter's own; remembers what DMA may be pointed at."""

import uctypes as _own
from chip import memory
from uctypes import *  # noqa: F403


def addressof(buffer):
    """Address of a buffer; the DMA streams will find it there."""
    where = _own.addressof(buffer)
    memory.objects[where & memory.MASK] = buffer
    return where
