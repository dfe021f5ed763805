"""Checksums and copies over buffers that allocate nothing, so that they may run during a motion."""

from array import array

import micropython
from micropython import const


def _nibble_table() -> array:
    """crc32 (IEEE, reflected) of the 16 nibbles, and what a crc begins with."""
    table = array("I", [0] * 16 + [0xFFFFFFFF])
    for nibble in range(16):
        crc = nibble
        for _ in range(4):
            crc = (crc >> 1) ^ (0xEDB88320 if crc & 1 else 0)
        table[nibble] = crc
    return table


TABLE = _nibble_table()
"""First argument of ``seal``."""
CHECK = const(4)
"""Last argument of ``seal`` that has it look only."""


@micropython.viper
def seal(table: ptr32, data: ptr8, places: int, there: int) -> int:
    """Write the crc32 of data[start:end] behind it, little endian; ``places`` = start | end << 15, ``there`` = 0.

    CHECK: the four bytes behind data[start:end] stay; 1 where they are its crc32, else 0.
    """
    at = places & 0x7FFF
    end = (places >> 15) + there
    crc = uint(table[16])
    while at < end:
        crc ^= data[at]
        crc = uint((crc >> 4) ^ table[crc & 15])
        crc = uint((crc >> 4) ^ table[crc & 15])
        at += 1
    crc ^= uint(table[16])
    # the crc of anything with its crc behind it
    good = 1 if int(crc) == 0x2144DF1C else 0
    while there < CHECK:
        data[at] = crc
        crc >>= 8
        at += 1
        there += 1
    return good


@micropython.viper
def copy(target: ptr8, source: ptr8, places: int, count: int) -> object:
    """Copy ``count`` bytes; ``places`` = index in target | index in source << 15, see ``places()``.

    Within one buffer it may only move bytes down.
    """
    to = places & 0x7FFF
    at = places >> 15
    end = at + count
    while at < end:
        target[to] = source[at]
        to += 1
        at += 1


@micropython.viper
def same(one: ptr8, other: ptr8, places: int, count: int) -> int:
    """1 where ``count`` bytes are equal, else 0; ``places`` = index in one | index in other << 15."""
    at = places & 0x7FFF
    gap = (places >> 15) - at
    end = at + count
    while at < end:
        if one[at] != other[at + gap]:
            return 0
        at += 1
    return 1


@micropython.viper
def spread(target: ptr8, raw: ptr8, places: int, joints: int) -> object:
    """From the engine's (ticks low, high, commanded[], counts[]) to the order of the wire.

    ``places``: index of the ticks in target | index of the joints' pairs (commanded, count) << 15.
    """
    to = places & 0x7FFF
    at = 0
    while at < 8:
        target[to + at] = raw[at]
        at += 1
    to = places >> 15
    joints <<= 2
    end = at + joints
    while at < end:
        target[to] = raw[at]
        target[to + 4] = raw[at + joints]
        to += 1
        at += 1
        if not at & 3:
            to += 4


def places(to: int, at: int) -> int:
    """Both indices of ``copy`` in one small integer (viper functions take four arguments at most)."""
    return to | at << 15


def u32(data: "bytes | bytearray", at: int) -> int:
    """The unsigned word at data[at:at+4]; allocates only where it is 2**30 or more."""
    return data[at] | data[at + 1] << 8 | data[at + 2] << 16 | data[at + 3] << 24
