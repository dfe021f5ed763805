"""The motion record: uploaded by the host, stored in the flash, read by the evaluator.

Little endian. Control points are integers, so that host and board have exactly the same splines: angles in
steps / 2**28, times in ticks / 2**16.

::

    offset  type   field
    0       4s     magic  b"ATM4"
    4       B      degree k, 3 or 5
    5       B      joints
    6       B      flags: bit 0, all joints share one time axis; bits 1 to 4: e
    7       B      lengths of ramps count in 2 ** this ticks, 6 to 19
    8       H      segments n of the angle splines
    10      H      refine R: the time axes have n * R segments
    12      I      crc32 of the arm record it was made for
    16      H[64]  ramps to rest that begin at 64 times from start to end. Low 11 bits: length, interpolated
                   linearly. High bits: shape (RAMP_SHAPES), up to the next time. All 0: not possible
    144     H[32]  the same at 32 times for all other changes of speed
    208     q[]    per joint: n + k angle control points; its n * R + k time control points,
                   or, with a shared axis, those once after the last joint
    ...            what the host keeps with it, see armtempo.encoding.made_with; the board does not read it
    end     I      crc32 over all before it

With e = 0, the times of ramps are equidistant; else those in the first and in the last duration / 2 ** e, and those
between. Each end then has four ninths of the spaces between them (``edge_parts``): a motion with a long middle of
constant speed can brake quickly in its ramps, too.
"""

import io
import struct
from binascii import crc32

from armtempo_shared.limits import MAX_JOINTS, MAX_SEGMENTS

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import BinaryIO

    Ramps = tuple[Sequence[int], Sequence[int], int, int]

MAGIC = b"ATM4"
SHARED_AXIS = 1
_EDGE_BIT = 1
LEAST_EDGE_BITS = 2
MOST_EDGE_BITS = 15
REST_ENTRIES = 64
OTHER_ENTRIES = 32
RAMP_LENGTH = 2047
"""Mask of an entry's length, and the largest length."""
RAMP_SHAPE_BIT = 11
"""First bit of an entry's shape."""
LEAST_RAMP_BITS = 6
MOST_RAMP_BITS = 19
"""Largest unit of lengths; the longest ramp is then 12.8 s."""
_HEAD = "<4sBBBBHHI"
_RAMPS = "<%dH" % (REST_ENTRIES + OTHER_ENTRIES)
_RAMPS_AT = struct.calcsize(_HEAD)
HEAD_SIZE = _RAMPS_AT + struct.calcsize(_RAMPS)
RAMP_SHAPES = (
    b"\xb5\xc2\x95\x43\x64\x82\xe5\xf1\xf1\x21\xf1\x71\x43\xc2\xf4\x76\xf6\xa6\xf1\xf5\x84\x93\xf3\xf1"
    b"\xa4\x82\xf3\xf1\xf3\xf6\xc8\x82"
)
"""p + 16 q of each shape: from the end with the lower rate, the slope of the ramp rises linearly to s1 over p/16 of
its length, changes linearly to s2 until q/16, and falls to 0. Of 30 random motions each has one close to its best."""
RAMP_WAYS = (
    b"\x20\x2a\x26\x36\x24\x20\x20\x20\x1c\x37\x24\x2c\x26\x20\x1e\x22\x1e\x20\x28\x22\x21\x29\x28\x1e"
    b"\x2a\x26\x24\x22\x1e\x22\x1e\x24"
)
"""64 w of each shape: the motion's time in a ramp from 0 to 1, as a fraction of its length, which with p and q
determines s1 and s2."""
EVEN_RAMP = 0
"""The shape of ramps that do not end at rest."""
_MOST_PLACES = 1 << 18
"""Times of a motion are counted so that this is more than those between which the entries are equidistant: their
products with lengths, and with numbers of entries, are then small integers of MicroPython."""


class MotionError(ValueError):
    """The record is damaged or of an unknown kind."""


def size(degree: int, joints: int, shared: bool, segments: int, refine: int) -> int:
    """Bytes of a motion record, without what the host keeps with it."""
    axes = 1 if shared else joints
    points = joints * (segments + degree) + axes * (segments * refine + degree)
    return HEAD_SIZE + 8 * points + 4


def no_ramps() -> "tuple[tuple[int, ...], tuple[int, ...], int, int]":
    """Ramps of a motion that can neither brake nor change its speed."""
    return (0,) * REST_ENTRIES, (0,) * OTHER_ENTRIES, MOST_RAMP_BITS, 0


def pack_head(shape: "tuple[int, int, bool, int, int]", ramps: "Ramps", arm_crc: int) -> bytes:
    """The first HEAD_SIZE bytes of a motion record; ``shape``: the arguments of ``size``."""
    degree, joints, shared, segments, refine = shape
    flags = (SHARED_AXIS if shared else 0) | ramps[3] << _EDGE_BIT
    head = struct.pack(_HEAD, MAGIC, degree, joints, flags, ramps[2], segments, refine, arm_crc)
    return head + struct.pack(_RAMPS, *ramps[0], *ramps[1])


def pack(
    degree: int,
    angles: "list[list[int]]",
    times: "list[list[int]]",
    refine: int,
    ramps: "Ramps",
    arm_crc: int,
) -> bytes:
    """A motion record of n path segments with ``refine`` R time segments each.

    ``angles``: per joint its n + k control points (int, steps * 2**28); ``times``: per joint, or one for
    all, its n * R + k control points (int, ticks * 2**16). ``ramps``: REST_ENTRIES entries of ramps to rest,
    OTHER_ENTRIES of others, the bits of their unit, and e.
    """
    segments = len(angles[0]) - degree
    shared = len(times) == 1 and len(angles) > 1
    head = pack_head((degree, len(angles), shared, segments, refine), ramps, arm_crc)
    body: "list[int]" = []
    for joint, points in enumerate(angles):
        body.extend(points)
        if not shared:
            body.extend(times[joint])
    if shared:
        body.extend(times[0])
    data = head + struct.pack("<%dq" % len(body), *body)
    return data + struct.pack("<I", crc32(data))


def edge_parts(parts: int) -> int:
    """How many of the ``parts`` between entries each end has, if its entries are closer than those in the middle."""
    return parts * 4 // 9


def is_edge(edge_bits: int) -> bool:
    """Whether this is an e of a record."""
    return edge_bits == 0 or LEAST_EDGE_BITS <= edge_bits <= MOST_EDGE_BITS


def checked_crc(data: "bytes | memoryview") -> int:
    """The crc32 at the end of a record; raises MotionError if it is wrong."""
    stated = int(struct.unpack_from("<I", data, len(data) - 4)[0])
    if crc32(memoryview(data)[:-4]) != stated:
        raise MotionError("checksum")
    return stated


class MotionHead:
    """The head of a motion record; ``length``: bytes of the whole record.

    Raises MotionError if the record is incomplete or of an unknown kind. A subclass checks the checksum, and
    provides the control points by ``stream``.
    """

    crc: int
    """The record's checksum, by which host and board know it."""

    def __init__(self, head: "bytes | memoryview", length: int) -> None:
        if length < HEAD_SIZE + 4 or len(head) < HEAD_SIZE:
            raise MotionError("too short")
        (magic, self.degree, self.joints, flags, self.ramp_bits, self.segments, self.refine,
         self.arm_crc) = struct.unpack_from(_HEAD, head, 0)  # fmt: skip
        self.edge_bits = flags >> _EDGE_BIT
        if (
            magic != MAGIC
            or not LEAST_RAMP_BITS <= self.ramp_bits <= MOST_RAMP_BITS
            or not is_edge(self.edge_bits)
        ):
            raise MotionError("not a motion record of this version")
        if self.degree not in (3, 5) or not 1 <= self.joints <= MAX_JOINTS:
            raise MotionError("unknown degree or number of joints")
        if self.segments < 1 or self.refine < 1 or self.segments * self.refine > MAX_SEGMENTS:
            raise MotionError("number of segments out of range")
        self.shared = bool(flags & SHARED_AXIS)
        self.ramps = bytes(head[_RAMPS_AT:HEAD_SIZE])
        self.can_brake = any(self.ramps)
        if length < size(self.degree, self.joints, self.shared, self.segments, self.refine):
            raise MotionError("length does not fit the header")

    def ramp(self, at: int, duration: int, to_rest: bool) -> int:
        """The entry for a change of speed that begins at time ``at`` of the motion; its length is interpolated.

        ``at`` is rounded down, the motion's ``duration`` up to 1024 ticks. The length is interpolated for a time a
        little earlier or later, with which it is longer.
        """
        parts = (REST_ENTRIES if to_rest else OTHER_ENTRIES) - 1
        place = 0 if to_rest else REST_ENTRIES
        at = min(max(at, 0), duration)
        width = duration
        if self.edge_bits:
            side = edge_parts(parts)
            width >>= self.edge_bits
            if at < width:
                parts = side
            elif at >= duration - width:
                at -= duration - width
                place += parts - side
                parts = side
            else:
                at -= width
                width = duration - 2 * width
                place += side
                parts -= 2 * side
        while width >= _MOST_PLACES:
            at >>= 1
            width = (width >> 1) + 1
        width = max(width, 1)
        at *= parts
        first = min(at // width, parts - 1)
        at -= first * width
        place = 2 * (place + first)
        ramps = self.ramps
        entry = ramps[place] + (ramps[place + 1] << 8)
        less = (entry & RAMP_LENGTH) - (ramps[place + 2] + (ramps[place + 3] << 8) & RAMP_LENGTH)
        # as all of this is rounded
        at = min(at + 4 * parts, width) if less < 0 else max(at - 2 * parts, 0)
        return entry - less * at // width

    def angle_offset(self, joint: int) -> int:
        """Byte offset of the joint's first angle control point."""
        points = int(self.segments + self.degree)
        if not self.shared:
            points += self.segments * self.refine + self.degree
        return HEAD_SIZE + 8 * joint * points

    def time_offset(self, joint: int) -> int:
        """Byte offset of the joint's first time control point."""
        last = self.joints - 1 if self.shared else joint
        return self.angle_offset(last) + 8 * int(self.segments + self.degree)

    def stream(self, offset: int) -> "BinaryIO":
        """A file at a byte offset of the record; the caller closes it."""
        raise NotImplementedError

    def points(self, offset: int, count: int) -> "tuple[int, ...]":
        """``count`` control points from a byte offset."""
        stream = self.stream(offset)
        try:
            return struct.unpack("<%dq" % count, stream.read(8 * count))
        finally:
            stream.close()


class Motion(MotionHead):
    """A checked view of a motion record in memory; only the header is copied.

    Raises MotionError if the record is incomplete, damaged or of an unknown kind. The motion itself (ranges, rates,
    order of times) is not checked; the board does that before a start.
    """

    def __init__(self, data: "bytes | memoryview") -> None:
        super().__init__(data[:HEAD_SIZE], len(data))
        self.crc = checked_crc(data)
        self.data = data

    def stream(self, offset: int) -> "BinaryIO":
        """See ``MotionHead``."""
        found: BinaryIO = io.BytesIO(self.data[offset:])
        return found
