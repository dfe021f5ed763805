"""Makes the record of the way back along a stored motion (``backwards.py``); the board never loads this."""

import struct
from binascii import crc32

from armtempo_shared import motion
from armtempo_shared.backwards import HEAD, MAGIC
from armtempo_shared.basis import BASIS, FACTORIAL
from armtempo_shared.motion import OTHER_ENTRIES, REST_ENTRIES

TYPE_CHECKING = False
if TYPE_CHECKING:
    from armtempo_shared.motion import MotionHead, Ramps


def pack(data: bytes, name: str, ramps: "Ramps") -> bytes:
    """The record of the way back along the motion record ``data``, stored as ``name``; ``ramps``: of the way back."""
    stored = motion.Motion(data)
    origins = [_end(stored, axis) for axis in range(1 if stored.shared else stored.joints)]
    body = struct.pack(HEAD, MAGIC, stored.crc, ramps[2], ramps[3], len(origins))
    body += struct.pack("<%dH" % (REST_ENTRIES + OTHER_ENTRIES), *ramps[0], *ramps[1])
    body += struct.pack("<%dq" % len(origins), *origins) + name.encode()
    return body + struct.pack("<I", crc32(body))


def _end(stored: "MotionHead", joint: int) -> int:
    """Time at the end of a joint's motion, ticks / 2**16, rounded up."""
    degree = stored.degree
    points = stored.points(stored.time_offset(joint) + 8 * stored.segments * stored.refine, degree)
    total = sum([weight * point for weight, point in zip(BASIS[degree][0], points)])
    return -(-total // FACTORIAL[degree])
