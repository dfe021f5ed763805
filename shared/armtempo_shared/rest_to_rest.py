"""Moves from rest to rest along a straight line in the joints' steps, in closed form and integers.

A move is one of ``shapes.SHAPES``, times the joints' distances, in the least time that keeps all limits: host and board
make the same record.
"""

import struct
from binascii import crc32

from armtempo_shared import motion
from armtempo_shared.limits import STEP_FRACTION_BITS, TICK_FRACTION_BITS, TICK_HZ
from armtempo_shared.motion import (
    LEAST_RAMP_BITS,
    MOST_RAMP_BITS,
    OTHER_ENTRIES,
    RAMP_LENGTH,
    RAMP_SHAPE_BIT,
    REST_ENTRIES,
)
from armtempo_shared.shapes import FACTOR_BITS, POINT_BITS, RAMP_BITS, SHAPES

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

DEGREE = 5
SHORTEST_TICKS = TICK_HZ // 20
PERCENT = 100
_FACTORS = "<4I"
_EDGE_BITS = 3
_ENTRIES = REST_ENTRIES + OTHER_ENTRIES
_POINTS_AT = struct.calcsize(_FACTORS)


class TooLongError(ValueError):
    """The move would take longer than its ramps can be described for: its target is too far for the speed."""


class Move:
    """The move of joints from ``start`` to ``target``, in steps.

    ``limits``: of each joint speed, acceleration and jerk in steps and seconds, at least 1; ``rate_sum``: most steps/s
    of all together; ``percent``: of the speed, 1 to 100. Raises TooLongError.
    """

    def __init__(
        self,
        start: "Sequence[int]",
        target: "Sequence[int]",
        limits: "Sequence[Sequence[int]]",
        rate_sum: int,
        percent: int = PERCENT,
    ) -> None:
        self._start = start
        self._distances = [end - begin for begin, end in zip(start, target)]
        self.duration_ticks = 0
        for shape in SHAPES:
            ticks = _ticks([abs(distance) for distance in self._distances], limits, rate_sum, shape)
            if not self.duration_ticks or ticks < self.duration_ticks:
                self.duration_ticks = ticks
                self._shape = shape
        self.duration_ticks = max(self.duration_ticks, SHORTEST_TICKS) * PERCENT // percent
        self._count = _points(self._shape)
        self._ramps = self._scaled_ramps()
        self._record = DEGREE, len(start), len(start) > 1, self._count - DEGREE, 1
        self.size = motion.size(*self._record)
        """Bytes of its record."""

    def pieces(self, arm_crc: int) -> "Iterator[bytes]":
        """Its motion record for an arm, in pieces, as the board has little memory."""
        head = motion.pack_head(self._record, self._ramps, arm_crc)
        crc = crc32(head)
        yield head
        bits = STEP_FRACTION_BITS - POINT_BITS
        for begin, distance in zip(self._start, self._distances):
            data = self._scaled(0, distance, bits, begin << STEP_FRACTION_BITS)
            crc = crc32(data, crc)
            yield data
        data = self._scaled(1, self.duration_ticks, TICK_FRACTION_BITS - POINT_BITS, 0)
        yield data
        yield struct.pack("<I", crc32(data, crc))

    def _scaled(self, row: int, factor: int, bits: int, begin: int) -> bytes:
        """Control points of the shape's distance (row 0) or time (1): times ``factor`` * 2**bits, plus ``begin``."""
        points = struct.unpack_from("<%di" % self._count, self._shape, _POINTS_AT + 4 * self._count * row)
        half = 1 << -bits - 1
        return struct.pack(
            "<%dq" % self._count, *[begin + (point * factor + half >> -bits) for point in points]
        )

    def _scaled_ramps(self) -> "motion.Ramps":
        """The shape's ramps for the move's time; lengths are rounded up."""
        entries = struct.unpack_from("<%dH" % _ENTRIES, self._shape, _POINTS_AT + 8 * self._count)
        longest = max([entry & RAMP_LENGTH for entry in entries]) * self.duration_ticks >> RAMP_BITS
        bits = LEAST_RAMP_BITS
        while (longest >> bits) + 1 > RAMP_LENGTH:
            bits += 1
        if bits > MOST_RAMP_BITS:
            raise TooLongError("longer than its ramps")
        scaled = []
        for entry in entries:
            shape = entry >> RAMP_SHAPE_BIT
            length = (entry & RAMP_LENGTH) * self.duration_ticks >> RAMP_BITS + bits
            scaled.append((shape << RAMP_SHAPE_BIT) + length + 1)
        edge_bits = struct.unpack_from(_FACTORS, self._shape, 0)[_EDGE_BITS]
        return scaled[:REST_ENTRIES], scaled[REST_ENTRIES:], bits, edge_bits


def _points(shape: bytes) -> int:
    """Number of control points of a shape."""
    return (len(shape) - _POINTS_AT - 2 * _ENTRIES) // 8


def _ticks(distances: "list[int]", limits: "Sequence[Sequence[int]]", rate_sum: int, shape: bytes) -> int:
    """The least time of a shape for distances in steps, rounded up."""
    factors = struct.unpack_from(_FACTORS, shape, 0)
    longest: int = (sum(distances) * factors[0] * TICK_HZ >> FACTOR_BITS) // rate_sum + 1
    for distance, most in zip(distances, limits):
        for order in range(3):
            power = distance * factors[order] * int(TICK_HZ ** (order + 1)) // (most[order] << FACTOR_BITS)
            longest = max(longest, _root(power, order + 1) + 1)
    return longest


def _root(value: int, order: int) -> int:
    """The root of an integer, rounded down."""
    if order == 1 or not value:
        return value
    root = 1
    while int(root**order) <= value:
        root *= 2
    while True:
        closer = ((order - 1) * root + value // int(root ** (order - 1))) // order
        if closer >= root:
            return root
        root = closer
