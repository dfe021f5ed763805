"""The program record: a user's program, and the arm's names in the board's numbers.

Little endian::

    offset  type   field
    0       4s     magic  b"ATP1"
    4       I      crc32 of the arm record it was made for
    8       H      bytes T of the table
    10      H      bytes S of the source
    12      T      the table, in JSON (below)
    ...     S      the source, in UTF-8; the host has put its marks into it (``MARK``)
    ...     i[]    places of pallets: per place the steps of each joint above it, then those at it
    end     I      crc32 over all before it

The table has

- ``file``: name of the source file, as tracebacks show it;
- ``limits``: of each joint [speed, acceleration, jerk] for moves that the board makes, in steps;
- ``per_deg``: steps per degree of each joint;
- ``postures``: {name: [steps of each joint]};
- ``motions``: {name: crc32} of the motions that were uploaded with it;
- ``outputs``: {name: [number, value at 0, value at 65535, {state: 0 to 65535}]};
- ``inputs``: {name: number};
- ``pallets``: {name: [rows, columns, layers, {tool: number of its first place above, from 0}]};
- ``tools``: {name: {posture: [steps of each joint]}} of the postures that are others with this tool;
- ``counters``: [names] that the source counts;
- ``taken``: pins ("A15") and timers (2) of the arm, of a source that calls ``FREE``;
- ``homing``: {} of a program that does not home the arm; else ``fast`` and ``slow``, as ``limits``, for both
  approaches, and ``groups``: of joints that are homed together a list of [joint, side (-1: low end, 1: high), steps
  where its switch trips, those of the range's end there, length of the range, of the longest approach, of the last way
  back, of that between both approaches, the farthest that the switch may stay pressed, and how near its end a motion
  counts as not stopped], ``names``: of each joint [name, unit].
"""

import json
import struct
from binascii import crc32

from armtempo_shared.limits import MAX_MOTION_BYTES

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

MAGIC = b"ATP1"
SUFFIX = ".py"
"""After the name of a program in the messages of sequences, which are those of programs too."""
MARK = "__at__"
"""The marked source calls it with the number of a line before what the line does in the cell, and in each pass of a
loop."""
EACH = "__each__"
"""It calls this with the number of a line and what a loop goes through."""
STILL = "__still__"
"""It calls this with the number of a line, the name of a function that writes to the flash, and the function, or what
has it."""
FREE = "__free__"
"""It calls this with the number of a line and the pin or timer that the program takes for itself."""
HEAP_BYTES = 16_000
"""Heap that a program needs besides its own: its interface, and the start of a motion,"""
HEAP_PER_BYTE = 8
"""and for each byte of the source, most of it while it is compiled (host/docs/measurements.md);"""
HOMING_BYTES = 4_500
"""and if it homes the arm."""
_HEAD = "<4sIHH"
HEAD_BYTES = struct.calcsize(_HEAD)
_CRC_BYTES = 4


class ProgramError(ValueError):
    """The record is damaged or of an unknown kind; or the program is too large."""


def needed_bytes(source_bytes: int, homes: bool = False) -> int:
    """Heap that a program with a source of this size needs."""
    return HEAP_BYTES + HEAP_PER_BYTE * source_bytes + HOMING_BYTES * homes


def pack(
    arm_crc: int, table: "dict[str, Any]", source: str, places: "list[list[int]] | tuple[()]" = ()
) -> bytes:
    """A program record; raises ProgramError if it is too large. ``places``: of each the steps above it and at it."""
    names, text = json.dumps(table).encode(), source.encode()
    where = b"".join([struct.pack("<%di" % len(place), *place) for place in places])
    if HEAD_BYTES + len(names) + len(text) + len(where) + _CRC_BYTES > MAX_MOTION_BYTES:
        raise ProgramError("too large")
    data = struct.pack(_HEAD, MAGIC, arm_crc, len(names), len(text)) + names + text + where
    return data + struct.pack("<I", crc32(data))


class ProgramRecord:
    """A record of ``length`` bytes; a subclass provides the bytes by ``part``, and checks the checksum.

    Raises ProgramError if the record is incomplete or of an unknown kind.
    """

    def __init__(self, length: int) -> None:
        if length < HEAD_BYTES + _CRC_BYTES:
            raise ProgramError("too short")
        magic, self.arm_crc, self._table_bytes, self.source_bytes = struct.unpack(
            _HEAD, self.part(0, HEAD_BYTES)
        )
        if magic != MAGIC:
            raise ProgramError("no program record of this version")
        self._places_at = HEAD_BYTES + self._table_bytes + self.source_bytes
        if length < self._places_at + _CRC_BYTES:
            raise ProgramError("length does not fit the header")

    def part(self, offset: int, size: int) -> bytes:
        """``size`` bytes of the record from ``offset`` on."""
        raise NotImplementedError

    def table(self) -> "dict[str, Any]":
        """Its table; raises ValueError if it is none."""
        found: "dict[str, Any]" = json.loads(self.part(HEAD_BYTES, self._table_bytes).decode())
        return found

    def place(self, number: int, joints: int) -> "tuple[int, ...]":
        """The steps of each joint above a place, then those at it."""
        layout = "<%di" % (2 * joints)
        size = struct.calcsize(layout)
        return struct.unpack(layout, self.part(self._places_at + number * size, size))

    def source(self) -> str:
        """The marked source."""
        return self.part(HEAD_BYTES + self._table_bytes, self.source_bytes).decode()
