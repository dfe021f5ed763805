"""A stored motion backwards: its control points are read from the last to the first.

Nothing of it is stored: see ``armtempo_shared.backwards``.
"""

import micropython
from armtempo_shared import codes
from micropython import const

from armtempo_board.errors import Refused
from armtempo_board.storage.motion_file import MotionFile

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from armtempo_shared.backwards import WayBack

_POINT_BYTES = const(8)
_HALVES = const(4)  # 16-bit words of a point


@micropython.viper
def _turn(words: ptr16, points: int) -> object:
    """Reverse the order of ``points`` control points."""
    low = 0
    high = _HALVES * (points - 1)
    while low < high:
        end = low + _HALVES
        while low < end:
            word = words[low]
            words[low] = words[high]
            words[high] = word
            low += 1
            high += 1
        high -= 2 * _HALVES


@micropython.viper
def _subtract(words: ptr16, points: int, origin: ptr16) -> object:
    """Subtract each of ``points`` control points from the origin."""
    at = 0
    end = _HALVES * points
    while at < end:
        borrow = 0
        half = 0
        while half < _HALVES:
            rest = int(origin[half]) - int(words[at]) - borrow
            words[at] = rest & 0xFFFF
            borrow = rest >> 16 & 1
            half += 1
            at += 1


class Backwards(MotionFile):
    """The motion in the file ``path`` of ``length`` bytes, backwards; ``way``: what the host sent for it.

    Raises as ``MotionFile``; Refused with BAD_CHECKSUM if it is another motion than the host means.
    """

    def __init__(self, path: str, length: int, way: "WayBack") -> None:
        super().__init__(path, length)
        if self.crc != way.stored_crc or len(way.origins) != (1 if self.shared else self.joints):
            raise Refused(codes.BAD_CHECKSUM)
        self.crc = way.crc
        self.ramps = way.ramps
        self.ramp_bits = way.ramp_bits
        self.edge_bits = way.edge_bits
        self.can_brake = any(way.ramps)
        self._origins = way.origins

    def stream(self, offset: int) -> "Any":
        """See ``MotionHead``."""
        joint = 0
        while joint + 1 < self.joints and self.angle_offset(joint + 1) <= offset:
            joint += 1
        begin, points, origin = self.angle_offset(joint), self.segments + self.degree, b""
        time_at = self.time_offset(joint)
        if offset >= time_at:
            begin, points = time_at, self.segments * self.refine + self.degree
            axis = 0 if self.shared else joint
            origin = self._origins[axis]
        return _Stream(super().stream(0), begin + _POINT_BYTES * points - (offset - begin), origin)


class Reader:
    """What reads into memory, as a file that reads too."""

    def read(self, count: int) -> bytearray:
        """As of a file."""
        target = bytearray(count)
        self.readinto(target)
        return target

    def readinto(self, target: "Any") -> int:
        """As of a file."""
        raise NotImplementedError

    def close(self) -> None:
        """As of a file."""


class _Stream(Reader):
    """Reads ``file`` backwards from ``end`` on, point by point; ``origin``: of a time axis."""

    def __init__(self, file: "Any", end: int, origin: bytes) -> None:
        self._file = file
        self._end = end
        self._origin = origin

    def readinto(self, target: "Any") -> int:
        """Allocates nothing. Before the first control point, bytes that nobody uses follow, as in the file."""
        size = len(target)
        self._end -= size
        self._file.seek(self._end)
        self._file.readinto(target)
        _turn(target, size // _POINT_BYTES)
        if self._origin:
            _subtract(target, size // _POINT_BYTES, self._origin)
        return size

    def close(self) -> None:
        """As of a file."""
        self._file.close()
