"""The record of the way back along a stored motion: sent to be run once, never stored.

The board reads the control points of the stored motion from the last to the first. Those of angles stay as they are;
those of a time axis are subtracted from its origin, the time at which the stored motion ends. So the path is exactly
the same, and only the ramps are sent. ``way_back.py``, which the board never loads, makes such a record.

::

    offset  type   field
    0       4s     magic  b"ATB2"
    4       I      crc32 of the stored motion
    8       B      lengths of ramps count in 2 ** this ticks
    9       B      e, the times of the ramps, as in the motion record
    10      B      time axes
    11      H[96]  ramps of the way back, as in the motion record
    203     q[]    origin of each time axis, ticks / 2**16
    ..      s      name of the stored motion
    end     I      crc32 over all before it
"""

import struct

from armtempo_shared import motion
from armtempo_shared.limits import MAX_JOINTS
from armtempo_shared.motion import (
    LEAST_RAMP_BITS,
    MOST_RAMP_BITS,
    OTHER_ENTRIES,
    REST_ENTRIES,
    MotionError,
    is_edge,
)

MAGIC = b"ATB2"
HEAD = "<4sIBBB"
ORIGIN_BYTES = 8
_RAMPS_AT = struct.calcsize(HEAD)
_ORIGINS_AT = _RAMPS_AT + 2 * (REST_ENTRIES + OTHER_ENTRIES)
_CRC_BYTES = 4


class WayBack:
    """The content of such a record; ``name``, ``stored_crc``: of the motion; ``ramps`` and their bits: as in it.

    Raises MotionError if the record is incomplete or damaged.
    """

    def __init__(self, data: "bytes | memoryview") -> None:
        if len(data) < _ORIGINS_AT + ORIGIN_BYTES + _CRC_BYTES:
            raise MotionError("too short")
        self.crc = motion.checked_crc(data)
        magic, self.stored_crc, self.ramp_bits, self.edge_bits, axes = struct.unpack_from(HEAD, data, 0)
        name_at = _ORIGINS_AT + ORIGIN_BYTES * axes
        if (
            magic != MAGIC
            or not LEAST_RAMP_BITS <= self.ramp_bits <= MOST_RAMP_BITS
            or not is_edge(self.edge_bits)
        ):
            raise MotionError("not a record of this version")
        if not 1 <= axes <= MAX_JOINTS or len(data) <= name_at + _CRC_BYTES:
            raise MotionError("length does not fit the header")
        self.ramps = bytes(data[_RAMPS_AT:_ORIGINS_AT])
        self.origins = [
            bytes(data[at : at + ORIGIN_BYTES]) for at in range(_ORIGINS_AT, name_at, ORIGIN_BYTES)
        ]
        try:
            self.name = bytes(data[name_at:-_CRC_BYTES]).decode()
        except UnicodeError:
            raise MotionError("name")
