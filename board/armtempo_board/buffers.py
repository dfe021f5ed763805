"""Checksums and copies in byte buffers. They allocate nothing, so they may run during a motion.

Viper functions take four arguments at most, so two offsets share one: see ``pack_offsets``.
"""

from array import array

import micropython
from micropython import const

_OFFSET_BITS = const(15)
_OFFSET_MASK = const((1 << 15) - 1)
_CRC_INIT = const(16)  # index in the table: initial value and final xor of a crc
_CRC_BYTES = const(4)
_NIBBLE = const(15)
_RESIDUE = const(0x2144DF1C)  # the crc32 of any data followed by its crc32
_BYTES_OF_TICKS = const(16)
_BYTES_OF_STEPS = const(4)
_BYTES_OF_U32 = const(4)
TICKS_LOW = const(0)
TICKS_HIGH = const(1)
PATH_LOW = const(2)
PATH_HIGH = const(3)
COMMANDED = const(4)
"""A sample is an array of words: its time, the motion's own time, then the joints' commanded steps from here on, then
their counts."""

APPEND = const(0)
"""Last argument of ``apply_crc``: append the crc to the data."""
CHECK = const(4)
"""Last argument of ``apply_crc``: compare with the crc after the data."""


def _crc_table() -> array:
    """crc32 (IEEE, reflected) of the 16 nibbles; then what a crc begins with."""
    table = array("I", [0] * _CRC_INIT + [0xFFFFFFFF])
    for nibble in range(_CRC_INIT):
        crc = nibble
        for _ in range(4):
            crc = (crc >> 1) ^ (0xEDB88320 if crc & 1 else 0)
        table[nibble] = crc
    return table


CRC_TABLE = _crc_table()
"""First argument of ``apply_crc``."""


def pack_offsets(first: int, second: int) -> int:
    """Two offsets below 2**15 in one small integer."""
    return first | second << _OFFSET_BITS


@micropython.viper
def apply_crc(table: ptr32, data: ptr8, offsets: int, present: int) -> int:
    """Compute the crc32 of data[start:end]; ``offsets``: start and end.

    APPEND: write it after the data, little endian. CHECK: return 1 if the four bytes after the data are equal
    to it, else 0.
    """
    at = offsets & _OFFSET_MASK
    end = (offsets >> _OFFSET_BITS) + present
    crc = uint(table[_CRC_INIT])
    while at < end:
        crc ^= data[at]
        crc = uint((crc >> 4) ^ table[crc & _NIBBLE])
        crc = uint((crc >> 4) ^ table[crc & _NIBBLE])
        at += 1
    crc ^= uint(table[_CRC_INIT])
    good = 1 if int(crc) == _RESIDUE else 0
    while present < _CRC_BYTES:
        data[at] = crc
        crc >>= 8
        at += 1
        present += 1
    return good


@micropython.viper
def copy(target: ptr8, source: ptr8, offsets: int, count: int) -> object:
    """Copy ``count`` bytes; ``offsets``: in target and in source. Within one buffer it may only move bytes down."""
    to = offsets & _OFFSET_MASK
    at = offsets >> _OFFSET_BITS
    end = at + count
    while at < end:
        target[to] = source[at]
        to += 1
        at += 1


@micropython.viper
def equal(one: ptr8, other: ptr8, offsets: int, count: int) -> int:
    """1 if ``count`` bytes are equal, else 0; ``offsets``: in one and in other."""
    at = offsets & _OFFSET_MASK
    distance = (offsets >> _OFFSET_BITS) - at
    end = at + count
    while at < end:
        if one[at] != other[at + distance]:
            return 0
        at += 1
    return 1


@micropython.viper
def sample_to_wire(target: ptr8, sample: ptr8, offsets: int, joints: int) -> object:
    """From the words of a sample to the order of the wire.

    ``offsets``: in target, of both times and of the joints' pairs (commanded, count).
    """
    to = offsets & _OFFSET_MASK
    at = 0
    while at < _BYTES_OF_TICKS:
        target[to + at] = sample[at]
        at += 1
    to = offsets >> _OFFSET_BITS
    joints <<= 2
    end = at + joints
    while at < end:
        target[to] = sample[at]
        target[to + _BYTES_OF_STEPS] = sample[at + joints]
        to += 1
        at += 1
        if not at & 3:
            to += _BYTES_OF_STEPS


def u32(data: "bytes | bytearray", at: int) -> int:
    """The unsigned word at data[at:at+4]; allocates only if it is 2**30 or more."""
    value = 0
    at += _BYTES_OF_U32
    for _ in range(_BYTES_OF_U32):
        at -= 1
        value = value << 8 | data[at]
    return value
