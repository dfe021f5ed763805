"""Finds frames in what the host sends, byte by byte in one fixed buffer, allocating nothing.

The frame layout is that of ``armtempo_shared.wire``. Never reads beyond the end of the frame that it is
in, and single bytes outside of frames, so that what follows stays with the port's own buffer.
"""

import time

from armtempo_shared.messages import MAX_PAYLOAD, OVERHEAD, SYNC
from micropython import const

from armtempo_board.buffers import CHECK, TABLE, copy, places, seal

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

_HEAD = const(5)  # SYNC, length, sequence, message id
_QUIET_MS = const(50)  # half a frame, then nothing for so long: its rest is not coming
_TURNS = const(8)  # reads or rejected candidates in one poll: bounds its time
_PIECE = const(64)


class FrameReader:
    """``poll`` until it says True; then the frame stands in ``data``, its payload from ``PAYLOAD`` on."""

    def __init__(self) -> None:
        self.data = bytearray(MAX_PAYLOAD + OVERHEAD)
        self.bad = 0  # stretches of bytes passed over
        self.outside = -1  # last byte that came outside of any frame; -1: none in this poll
        self._filled = 0
        self._whole = 0  # length of the whole frame that stands in data, 0: none
        self._skipping = False
        self._piece = bytearray(_PIECE)
        self._heard_ms = 0

    def length(self) -> int:
        """Payload bytes of the frame that stands in ``data``."""
        return self._whole - OVERHEAD

    def empty(self) -> bool:
        """Whether no part of a frame waits for its rest."""
        return self._filled == 0

    def poll(self, stream: "Any", now_ms: "Any") -> bool:
        """Whether a whole frame with the right check stands in ``data``, until the next poll."""
        self.outside = -1
        if self._whole:
            self._drop(self._whole)
            self._whole = 0
        for _ in range(_TURNS):
            missing = self._missing()
            if missing == 0:
                if self._accept():
                    return True
            elif not self._read(stream, missing, now_ms) or self.outside >= 0:
                return False
        return False

    def _missing(self) -> int:
        """Bytes still needed to judge the frame that begins at data[0]."""
        if self._filled < _HEAD:
            return 1 if self._filled == 0 else _HEAD - self._filled
        length = self.data[1] | self.data[2] << 8
        if length > MAX_PAYLOAD:
            return 0
        return max(0, length + OVERHEAD - self._filled)

    def _accept(self) -> bool:
        length = self.data[1] | self.data[2] << 8
        if length <= MAX_PAYLOAD and seal(TABLE, self.data, 1 | (length + _HEAD) << 15, CHECK):
            self._whole = length + OVERHEAD
            self._skipping = False
            return True
        self._reject()
        return False

    def _read(self, stream: "Any", missing: int, now_ms: "Any") -> bool:
        """Take up to ``missing`` bytes; False where none are there."""
        count = stream.readinto(self._piece, min(missing, _PIECE))
        if not count:
            if self._filled and time.ticks_diff(now_ms, self._heard_ms) >= _QUIET_MS:
                self._reject()
                return True
            return False
        self._heard_ms = now_ms
        if self._filled == 0 and self._piece[0] != SYNC:
            self.outside = self._piece[0]
            self._skip()
            return True
        copy(self.data, self._piece, places(self._filled, 0), count)
        self._filled += count
        return True

    def _skip(self) -> None:
        if not self._skipping:
            self._skipping = True
            self.bad += 1

    def _reject(self) -> None:
        """What begins at data[0] is no frame: go on at the next SYNC behind it."""
        self._skip()
        at = 1
        while at < self._filled and self.data[at] != SYNC:
            at += 1
        self._drop(at)

    def _drop(self, count: int) -> None:
        self._filled -= count
        copy(self.data, self.data, places(0, count), self._filled)
        at = 0
        while at < self._filled and self.data[at] != SYNC:
            at += 1
        if at:
            self._skip()
            self._filled -= at
            copy(self.data, self.data, places(0, at), self._filled)
