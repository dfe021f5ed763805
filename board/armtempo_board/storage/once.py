"""The motion that is run once: its record stays in memory, so it costs no erasure of the flash.

It is there until another one is sent or made by a program, a sequence starts, which may need the memory, or a reset.
"""

import gc

from armtempo_shared import codes
from armtempo_shared.backwards import MAGIC, WayBack
from armtempo_shared.motion import Motion

from armtempo_board.buffers import copy, pack_offsets
from armtempo_board.errors import Refused
from armtempo_board.storage.backwards import Backwards, Reader

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any


class Once:
    """``capacity``: bytes of the largest record."""

    def __init__(self, capacity: int) -> None:
        self.capacity = capacity
        self._data = bytearray(capacity)
        self._size = 0
        self._received = 0

    def put(self, offset: int, size: int, piece: bytes) -> int:
        """Add a piece of a record of ``size`` bytes; one at 0 begins it. Returns the offset of the next."""
        if size > self.capacity:
            raise Refused(codes.TOO_LONG, value=self.capacity)
        if not offset:
            self._begin(size)
        end = offset + len(piece)
        if size != self._size or offset > self._received or end > size:
            raise Refused(codes.BAD_OFFSET, value=self._received)
        self._data[offset:end] = piece
        self._received = end
        return end

    def _begin(self, size: int) -> None:
        self._size = size
        self._received = 0
        self.take_memory()

    def take_memory(self) -> None:
        """Have the memory for a record, also after ``release``; raises Refused."""
        if not self._data:
            gc.collect()
            try:
                self._data = bytearray(self.capacity)
            except MemoryError:
                raise Refused(codes.NO_MEMORY)

    def release(self) -> None:
        """Forget the motion, and give its memory back until another one comes."""
        self._data = bytearray(0)
        self._size = self._received = 0

    def motion(self, store: "Any") -> "Any":
        """The motion of the record, checked; ``store()``: that of the stored motions.

        Raises Refused with NOT_FOUND if there is none, or it is incomplete.
        """
        if not self._received or self._received != self._size:
            raise Refused(codes.NOT_FOUND)
        data = memoryview(self._data)[: self._size]
        try:
            if bytes(data[: len(MAGIC)]) != MAGIC:
                return _InMemory(data)
            way = WayBack(data)
            return store().motion(way.name, Backwards, way)
        except ValueError:  # MotionError
            raise Refused(codes.BAD_RECORD)


class _InMemory(Motion):
    """A motion whose control points are read without a copy of the record."""

    def stream(self, offset: int) -> "Any":
        """See ``MotionHead``."""
        return _Stream(self.data, offset)


class _Stream(Reader):
    """Reads ``data`` from ``at`` on."""

    def __init__(self, data: "bytes | memoryview", at: int) -> None:
        self._data = data
        self._at = at

    def readinto(self, target: "bytearray | memoryview") -> int:
        """Allocates nothing."""
        count = min(len(target), len(self._data) - self._at)
        copy(target, self._data, pack_offsets(0, self._at), count)
        self._at += count
        return count
