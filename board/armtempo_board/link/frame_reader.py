"""Finds frames in what the host sends, in one fixed buffer; allocates nothing.

The frame layout is that of ``armtempo_shared.wire``. It never reads beyond the end of the frame that it is in, and
outside of frames one byte at a time, so that what follows a frame stays in the port's own buffer.
"""

import time

from armtempo_shared.messages import LENGTH_AT, MAX_COMMAND, OVERHEAD, PAYLOAD_AT, SYNC
from micropython import const

from armtempo_board.buffers import CHECK, CRC_TABLE, apply_crc, copy, pack_offsets

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

_QUIET_MS = const(50)  # time after which an incomplete frame is dropped
_ATTEMPTS = const(8)  # reads and rejected frames in one poll: bounds its time
_PIECE = const(64)  # bytes read at once


class FrameReader:
    """Call ``poll`` until it returns True; then the frame is in ``data``."""

    def __init__(self) -> None:
        self.data = bytearray(MAX_COMMAND + OVERHEAD)
        self.bad = 0  # number of skipped runs of bytes
        self.outside = -1  # last byte received outside of a frame; -1: none in this poll
        self._filled = 0
        self._whole = 0  # length of the whole frame in data, 0: none
        self._skipping = False
        self._piece = bytearray(_PIECE)
        self._heard_ms = 0

    def length(self) -> int:
        """Payload bytes of the frame in ``data``."""
        return self._whole - OVERHEAD

    def empty(self) -> bool:
        """Whether there is no incomplete frame."""
        return self._filled == 0

    def poll(self, stream: "Any", now_ms: "Any") -> bool:
        """Whether a complete, valid frame is in ``data``, until the next poll."""
        self.outside = -1
        if self._whole:
            self._drop(self._whole)
            self._whole = 0
        for _ in range(_ATTEMPTS):
            missing = self._missing()
            if missing == 0:
                if self._accept():
                    return True
            elif not self._read(stream, missing, now_ms) or self.outside >= 0:
                return False
        return False

    def _missing(self) -> int:
        """Bytes missing in the frame that begins at data[0]."""
        if self._filled < PAYLOAD_AT:
            return 1 if self._filled == 0 else PAYLOAD_AT - self._filled
        length = self._announced()
        if length > MAX_COMMAND:
            return 0
        return max(0, length + OVERHEAD - self._filled)

    def _announced(self) -> int:
        """Payload bytes by the frame's head."""
        return self.data[LENGTH_AT] | self.data[LENGTH_AT + 1] << 8

    def _accept(self) -> bool:
        length = self._announced()
        if length > MAX_COMMAND or not apply_crc(
            CRC_TABLE, self.data, pack_offsets(LENGTH_AT, PAYLOAD_AT + length), CHECK
        ):
            self._reject()
            return False
        self._whole = length + OVERHEAD
        self._skipping = False
        return True

    def _read(self, stream: "Any", missing: int, now_ms: "Any") -> bool:
        """Read up to ``missing`` bytes; returns False if there are none."""
        count = stream.readinto(self._piece, min(missing, _PIECE))
        if not count:
            if self._filled and time.ticks_diff(now_ms, self._heard_ms) >= _QUIET_MS:
                self._reject()
                return True
            return False
        self._heard_ms = now_ms
        first = self._piece[0]
        if self._filled == 0 and first != SYNC:
            self.outside = first
            self._skip()
            return True
        copy(self.data, self._piece, pack_offsets(self._filled, 0), count)
        self._filled += count
        return True

    def _skip(self) -> None:
        if not self._skipping:
            self._skipping = True
            self.bad += 1

    def _reject(self) -> None:
        """There is no frame at data[0]: continue at the next SYNC."""
        self._skip()
        at = 1
        while at < self._filled and self.data[at] != SYNC:
            at += 1
        self._drop(at)

    def _drop(self, count: int) -> None:
        self._filled -= count
        copy(self.data, self.data, pack_offsets(0, count), self._filled)
        at = 0
        while at < self._filled and self.data[at] != SYNC:
            at += 1
        if at:
            self._skip()
            self._filled -= at
            copy(self.data, self.data, pack_offsets(0, at), self._filled)
