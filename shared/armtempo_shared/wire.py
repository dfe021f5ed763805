"""The wire protocol of the host: making and finding frames with ``table.py``.

A frame::

    0xA5 | length N (H) | sequence (B) | message id (B) | payload, N bytes | crc32 over length..payload (I)

little endian; see shared/docs/protocol.md. The board has its own frame finder, which allocates nothing
(``armtempo_board/link/frame_reader.py``); a test feeds both the same bytes.
"""

import struct
from binascii import crc32
from collections import namedtuple

try:
    from typing import Any
except ImportError:  # MicroPython: annotations are not evaluated there
    pass

from armtempo_shared.meanings import ERROR_CODES as ERROR_CODES
from armtempo_shared.meanings import ERRORS as ERRORS
from armtempo_shared.messages import ARM_RECORD_NAME as ARM_RECORD_NAME
from armtempo_shared.messages import MAX_PAYLOAD, SYNC
from armtempo_shared.messages import OVERHEAD as OVERHEAD
from armtempo_shared.messages import PROTOCOL_VERSION as PROTOCOL_VERSION
from armtempo_shared.messages import START_HOMING as START_HOMING
from armtempo_shared.messages import STATES as STATES
from armtempo_shared.table import rows

_HEAD = struct.calcsize("<HBB")


def _index(kinds: str) -> "tuple[dict[str, Any], dict[int, Any]]":
    by_name = {}
    by_id = {}
    for kind in kinds:
        for entry in rows(kind):
            by_name[entry[0]] = entry
            by_id[entry[1]] = entry
    return by_name, by_id


COMMAND, COMMAND_BY_ID = _index("COS")
ANSWER, ANSWER_BY_ID = _index("APT")
EVENT, EVENT_BY_ID = _index("ER")


Frame = namedtuple("Frame", ("sequence", "number", "payload"))
"""A received frame: sequence number, message id, payload."""


class WireError(ValueError):
    """A payload that does not fit its message."""


def encode(entry: "Any", values: "Any" = (), tail: "bytes | str" = b"") -> bytes:
    """The payload of a message: ``entry`` from an index above, field values in order, and tail."""
    rest = tail.encode() if isinstance(tail, str) else tail
    return struct.pack(entry[2], *values) + rest


def decode(entry: "Any", payload: bytes) -> "tuple[tuple[Any, ...], Any]":
    """(tuple of field values, tail) of a payload; raises WireError if it does not fit."""
    _, _, fields, _, kind = entry
    size = struct.calcsize(fields)
    if len(payload) < size or (not kind and len(payload) != size):
        raise WireError("length")
    tail: "Any" = bytes(payload[size:])
    if kind == "text":
        try:
            tail = tail.decode()
        except UnicodeError:
            raise WireError("text") from None
    return struct.unpack_from(fields, payload, 0), tail


def record_crc(data: bytes) -> int:
    """The number that identifies a record: its own crc32, the last four bytes.

    (The crc32 of everything, including it, is the same for all records.)
    """
    return int(struct.unpack_from("<I", data, len(data) - 4)[0])


def frame(sequence: int, number: int, payload: bytes) -> bytes:
    """The bytes of one frame."""
    body = struct.pack("<HBB", len(payload), sequence, number) + payload
    return bytes((SYNC,)) + body + struct.pack("<I", crc32(body))


class Parser:
    """Finds frames in a byte stream; keeps an incomplete one.

    ``bad`` counts sequences of bytes outside of frames.
    """

    def __init__(self, limit: int = MAX_PAYLOAD) -> None:
        self._buffer = bytearray()
        self._limit = limit
        self._skipping = False
        self.bad = 0

    def feed(self, data: bytes) -> None:
        """Add received bytes."""
        self._buffer.extend(data)

    def pending(self) -> int:
        """Number of bytes of an incomplete frame."""
        return len(self._buffer)

    def drop(self) -> None:
        """Skip the oldest byte, for a frame whose rest does not arrive."""
        self._skip(1)

    def _skip(self, count: int) -> None:
        if count:
            if not self._skipping:
                self.bad += 1
            self._skipping = True
            self._buffer = self._buffer[count:]

    def next(self) -> "Frame | None":
        """The next complete frame, or None."""
        while True:
            start = self._buffer.find(bytes((SYNC,)))
            self._skip(len(self._buffer) if start < 0 else start)
            if len(self._buffer) < 1 + _HEAD:
                return None
            length, sequence, number = struct.unpack_from("<HBB", self._buffer, 1)
            if length > self._limit:
                self._skip(1)
                continue
            end = 1 + _HEAD + length
            if len(self._buffer) < end + 4:
                return None
            if crc32(memoryview(self._buffer)[1:end]) != struct.unpack_from("<I", self._buffer, end)[0]:
                self._skip(1)
                continue
            payload = bytes(self._buffer[1 + _HEAD : end])
            self._buffer = self._buffer[end + 4 :]
            self._skipping = False
            return Frame(sequence, number, payload)
