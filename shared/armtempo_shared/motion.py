"""The motion record: uploaded by the host, kept in the flash, read by the evaluator.

Little endian. Control points are integers, so host and board have exactly the same spline:
angles in steps / 2**28, times in ticks / 2**16.

::

    offset  type   field
    0       4s     magic  b"ATM4"
    4       B      degree k, 3 or 5
    5       B      joints
    6       B      flags: bit 0, all joints share one time axis
    7       B      lengths of ramps count in 2 ** this ticks, 6 to 19
    8       H      segments n of the angle splines
    10      H      refine R: the time axes have n * R segments
    12      I      crc32 of the arm record it was made for
    16      H[64]  the ramp to rest, by where it begins: at 64 equal steps of the motion's time from its start to its
                   end. Low 11 bits: its length, linear in between. The rest: its shape (RAMP_SHAPES), up to the
                   next step. All 0: it cannot
    144     H[32]  the same at 32 steps for any other change of the speed
    208     q[]    per joint: n + k angle control points; its n * R + k time control points,
                   or, with a shared axis, those once after the last joint
    end     I      crc32 over all before it
"""

import io
import struct
from binascii import crc32

from armtempo_shared.limits import MAX_JOINTS, MAX_SEGMENTS

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import BinaryIO

    Ramps = tuple[Sequence[int], Sequence[int], int]

MAGIC = b"ATM4"
SHARED_AXIS = 1
REST_ENTRIES = 64
OTHER_ENTRIES = 32
RAMP_LENGTH = 2047
"""Mask of an entry's length, and the longest."""
RAMP_SHAPE_BIT = 11
"""Its shape is in the bits from this one on."""
LEAST_RAMP_BITS = 6
MOST_RAMP_BITS = 19
"""Of the unit of lengths; the longest ramp takes 12.8 s then."""
_HEAD = "<4sBBBBHHI"
_RAMPS = "<%dH" % (REST_ENTRIES + OTHER_ENTRIES)
_RAMPS_AT = struct.calcsize(_HEAD)
HEAD_SIZE = _RAMPS_AT + struct.calcsize(_RAMPS)
RAMP_SHAPES = (
    b"\xb5\xc2\x95\x43\x64\x82\xe5\xf1\xf1\x21\xf1\x71\x43\xc2\xf4\x76\xf6\xa6\xf1\xf5\x84\x93\xf3\xf1"
    b"\xa4\x82\xf3\xf1\xf3\xf6\xc8\x82"
)
"""Of each shape of ramps p + 16 q: from the end of a ramp at which the rate is least, its slope rises to s1 over p/16
of its length, goes to s2 until q/16, and falls to 0. For each of 30 random motions one is close to its best."""
RAMP_WAYS = (
    b"\x20\x2a\x26\x36\x24\x20\x20\x20\x1c\x37\x24\x2c\x26\x20\x1e\x22\x1e\x20\x28\x22\x21\x29\x28\x1e"
    b"\x2a\x26\x24\x22\x1e\x22\x1e\x24"
)
"""Of each shape 64 w: w of the ramp's length is the way of a rate from 0 to 1, which with p and q says what s1 and s2
are."""
EVEN_RAMP = 0
"""The shape for changes that are none to rest."""
NO_RAMPS = (0,) * REST_ENTRIES, (0,) * OTHER_ENTRIES, MOST_RAMP_BITS
"""Of a motion that can neither brake nor change its speed."""


class MotionError(ValueError):
    """The record is damaged or of an unknown kind."""


def size(degree: int, joints: int, shared: bool, segments: int, refine: int) -> int:
    """Bytes of a whole motion record."""
    axes = 1 if shared else joints
    points = joints * (segments + degree) + axes * (segments * refine + degree)
    return HEAD_SIZE + 8 * points + 4


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
    OTHER_ENTRIES of others, and the bits of their unit.
    """
    segments = len(angles[0]) - degree
    shared = len(times) == 1 and len(angles) > 1
    flags = SHARED_AXIS if shared else 0
    head = struct.pack(_HEAD, MAGIC, degree, len(angles), flags, ramps[2], segments, refine, arm_crc)
    head += struct.pack(_RAMPS, *ramps[0], *ramps[1])
    body: "list[int]" = []
    for joint, points in enumerate(angles):
        body.extend(points)
        if not shared:
            body.extend(times[joint])
    if shared:
        body.extend(times[0])
    data = head + struct.pack("<%dq" % len(body), *body)
    return data + struct.pack("<I", crc32(data))


class MotionHead:
    """What the head of a motion record says; ``length``: bytes of the whole record.

    Raises MotionError if the record is cut or of an unknown kind. Who subclasses it checks the checksum, and gives
    the control points in ``stream``.
    """

    def __init__(self, head: bytes, length: int) -> None:
        if length < HEAD_SIZE + 4 or len(head) < HEAD_SIZE:
            raise MotionError("too short")
        (magic, self.degree, self.joints, flags, self.ramp_bits, self.segments, self.refine,
         self.arm_crc) = struct.unpack_from(_HEAD, head, 0)  # fmt: skip
        if magic != MAGIC or not LEAST_RAMP_BITS <= self.ramp_bits <= MOST_RAMP_BITS or flags & ~SHARED_AXIS:
            raise MotionError("not a motion record of this version")
        if self.degree not in (3, 5) or not 1 <= self.joints <= MAX_JOINTS:
            raise MotionError("unknown degree or number of joints")
        if self.segments < 1 or self.refine < 1 or self.segments * self.refine > MAX_SEGMENTS:
            raise MotionError("number of segments out of range")
        self.shared = bool(flags & SHARED_AXIS)
        self.ramps = bytes(head[_RAMPS_AT:HEAD_SIZE])
        self.can_brake = any(self.ramps)
        if length != size(self.degree, self.joints, self.shared, self.segments, self.refine):
            raise MotionError("length does not fit the header")

    def ramp(self, at: int, duration: int, to_rest: bool) -> int:
        """The entry for a change of speed that begins at a time of the motion; its length is linear between two.

        ``at``, and how long the motion lasts, in a unit of which that is less than 8192, so all are small integers of
        the board: ``at`` rounded down, ``duration`` up. What is between two entries is taken up to 2 units later if
        the next one is longer.
        """
        parts = (REST_ENTRIES if to_rest else OTHER_ENTRIES) - 1
        at = parts * min(max(at, 0), duration)
        first = min(at // duration, parts - 1)
        at -= first * duration
        place = 2 * first + (0 if to_rest else 2 * REST_ENTRIES)
        ramps = self.ramps
        entry = ramps[place] + (ramps[place + 1] << 8)
        less = (entry & RAMP_LENGTH) - (ramps[place + 2] + (ramps[place + 3] << 8) & RAMP_LENGTH)
        if less < 0:
            at = min(at + 2 * parts, duration)
        return entry - less * at // duration

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
        """A file at a byte offset of the record; who asks for it closes it."""
        raise NotImplementedError

    def points(self, offset: int, count: int) -> "tuple[int, ...]":
        """``count`` control points from a byte offset on."""
        stream = self.stream(offset)
        try:
            return struct.unpack("<%dq" % count, stream.read(8 * count))
        finally:
            stream.close()


class Motion(MotionHead):
    """A checked view of a motion record in memory; copies nothing but the header.

    Raises MotionError if the record is cut, damaged or of an unknown kind. It does not check the
    motion itself (ranges, rates, order of times): the board does before a start.
    """

    def __init__(self, data: bytes) -> None:
        super().__init__(data, len(data))
        if crc32(memoryview(data)[:-4]) != struct.unpack_from("<I", data, len(data) - 4)[0]:
            raise MotionError("checksum")
        self.data = data

    def stream(self, offset: int) -> "BinaryIO":
        """See ``MotionHead``."""
        found: BinaryIO = io.BytesIO(self.data[offset:])
        return found
