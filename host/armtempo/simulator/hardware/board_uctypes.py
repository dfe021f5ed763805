"""The board program's ``uctypes``: the interpreter's own; remembers what DMA may be pointed at."""

import uctypes as _own
from uctypes import *  # noqa: F403
from virtual_board.chip import memory


def addressof(buffer):
    """Address of a buffer; the DMA streams will find it there."""
    where = _own.addressof(buffer)
    memory.objects[where & memory.MASK] = buffer
    return where
