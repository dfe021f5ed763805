"""The sequence record: the stored motions that the board runs one after the other, and the steps between them.

Little endian. It refers to its motions by name and checksum.

::

    offset  type   field
    0       4s     magic  b"ATS2"
    4       I      crc32 of the arm record it was made for
    8       H      rows R
    10      B      motions M
    11      B      counters C
    12      10 R   the rows: B op, B number, H value, I amount, H step
    ...     28 M   the motions: 24s name (padded with 0), I crc32 of the motion's record
    ...     24 C   the counters: 24s name (padded with 0)
    ...            what the host keeps with it, see armtempo.encoding.made_with; the board does not read it
    end     I      crc32 over all before it

If the first pass of a repeat begins at another posture than the others, its rows are before the repeat. ``step`` is
the step of the sequence file (from 1) of a row, for reports. The other fields by op:

====  ===========  ==================  ===============================  ================================
op                 number              value                            amount
====  ===========  ==================  ===============================  ================================
1     MOVE         of the motion       0                                0
2     OUTPUT       of the output       value, 0 to 65535                0
3     WAIT         0                   0                                ms
4     WAIT_INPUT   of the input        level | effect of a time-out     ms until the time-out, 0: none
5     REPEAT       0                   1: a pass is before it           number of times, 0: for ever
6     END          0                   1: its passes count as cycles    0
7     COUNT        of the counter      0                                0
====  ===========  ==================  ===============================  ================================

ATS1 had no counters.
"""

import struct
from binascii import crc32

from armtempo_shared.limits import MAX_NAME

MAGIC = b"ATS2"
KIND_BYTES = 3
"""Bytes of the magic that are the same in all versions."""
MOVE, OUTPUT, WAIT, WAIT_INPUT, REPEAT, END, COUNT = 1, 2, 3, 4, 5, 6, 7
ACTIVE = 1
"""Bit of the value of WAIT_INPUT: the level to wait for. The other bits are the effect of a time-out:"""
STOP_THEN, FAULT_THEN, NEXT_THEN = 0, 2, 4

ENDINGS = ("none", "running", "finished", "stopped", "timed_out", "fault", "refused")
"""State of a sequence, or how it ended, by its number on the wire; none: no sequence since the start."""
NONE, RUNNING, FINISHED, STOPPED, TIMED_OUT, FAULTED, REFUSED = 0, 1, 2, 3, 4, 5, 6

MAX_ROWS, MAX_MOTIONS, MAX_NESTING, MAX_COUNTERS = 500, 128, 4, 8
MAX_WAIT_MS = 3_600_000
MAX_REPEATS = 1_000_000

_HEAD = "<4sIHBB"
_ROW = "<BBHIH"
_MOTION = "<%dsI" % MAX_NAME
_COUNTER_BYTES = MAX_NAME
_HEAD_BYTES, _ROW_BYTES, _MOTION_BYTES = (
    struct.calcsize(_HEAD),
    struct.calcsize(_ROW),
    struct.calcsize(_MOTION),
)
_CRC_BYTES = 4


class SequenceError(ValueError):
    """The record is damaged or of an unknown kind."""


class OtherVersionError(SequenceError):
    """The record is of another version."""


def pack(
    arm_crc: int,
    rows: "list[tuple[int, ...]]",
    motions: "list[tuple[str, int]]",
    counters: "list[str] | tuple[str, ...]" = (),
) -> bytes:
    """A sequence record of ``rows`` (op, number, value, amount, step), ``motions`` (name, crc32), names of counters."""
    data = struct.pack(_HEAD, MAGIC, arm_crc, len(rows), len(motions), len(counters))
    for row in rows:
        data += struct.pack(_ROW, *row)
    for name, crc in motions:
        data += struct.pack(_MOTION, name.encode(), crc)
    for name in counters:
        data += struct.pack("%ds" % _COUNTER_BYTES, name.encode())
    return data + struct.pack("<I", crc32(data))


class SequenceRecord:
    """A record of ``length`` bytes; a subclass provides the bytes by ``part``, and checks the checksum.

    Raises SequenceError if the record is incomplete or of an unknown kind, OtherVersionError if it is of another
    version. ``sequence_check.check`` checks the rows.
    """

    def __init__(self, length: int) -> None:
        if length < _HEAD_BYTES + _CRC_BYTES:
            raise SequenceError("too short")
        magic, self.arm_crc, self.rows, self.motions, self.counters = struct.unpack(
            _HEAD, self.part(0, _HEAD_BYTES)
        )
        if magic != MAGIC:
            if magic[:KIND_BYTES] == MAGIC[:KIND_BYTES]:
                raise OtherVersionError("a sequence record of another version")
            raise SequenceError("no sequence record")
        self._counters_at = _HEAD_BYTES + _ROW_BYTES * self.rows + _MOTION_BYTES * self.motions
        self.end = self._counters_at + _COUNTER_BYTES * self.counters
        if length < self.end + _CRC_BYTES:
            raise SequenceError("length does not fit the header")
        if not 1 <= self.rows <= MAX_ROWS or self.motions > MAX_MOTIONS or self.counters > MAX_COUNTERS:
            raise SequenceError("more of something than the board takes")

    def part(self, offset: int, size: int) -> bytes:
        """``size`` bytes of the record from ``offset`` on."""
        raise NotImplementedError

    def row(self, index: int) -> "tuple[int, ...]":
        """(op, number, value, amount, step) of a row."""
        return struct.unpack(_ROW, self.part(_HEAD_BYTES + _ROW_BYTES * index, _ROW_BYTES))

    def motion(self, index: int) -> "tuple[str, int]":
        """(name, crc32) of a motion."""
        at = _HEAD_BYTES + _ROW_BYTES * self.rows + _MOTION_BYTES * index
        name, crc = struct.unpack(_MOTION, self.part(at, _MOTION_BYTES))
        try:
            return name.rstrip(b"\x00").decode(), crc
        except UnicodeError:
            raise SequenceError("a motion's name")

    def counter(self, index: int) -> bytes:
        """The name of a counter."""
        return self.part(self._counters_at + _COUNTER_BYTES * index, _COUNTER_BYTES).rstrip(b"\x00")


class SequenceData(SequenceRecord):
    """A checked view of a record in memory."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        super().__init__(len(data))
        if crc32(memoryview(data)[:-_CRC_BYTES]) != struct.unpack_from("<I", data, len(data) - _CRC_BYTES)[0]:
            raise SequenceError("checksum")

    def part(self, offset: int, size: int) -> bytes:
        """See ``SequenceRecord``."""
        return self._data[offset : offset + size]
