"""Checksums and copies over buffers that allocate nothing, so that they may run during a motion."""

from array import array

import micropython


def _nibble_table() -> array:
    """crc32 (IEEE, reflected) of the 16 nibbles, each as low and high half word."""
    table = array("H", [0] * 32)
    for nibble in range(16):
        crc = nibble
        for _ in range(4):
            crc = (crc >> 1) ^ (0xEDB88320 if crc & 1 else 0)
        table[2 * nibble] = crc & 0xFFFF
        table[2 * nibble + 1] = crc >> 16
    return table


TABLE = _nibble_table()
"""First argument of ``seal`` and ``sealed``."""


# The crc is kept in two half words, so that no word needs more than 31 bits on any interpreter.
@micropython.viper
def seal(table: ptr16, data: ptr8, start: int, end: int) -> object:
    """Write the crc32 of data[start:end] behind it, little endian."""
    low = 0xFFFF
    high = 0xFFFF
    at = start
    while at < end:
        low ^= data[at]
        for _ in range(2):
            entry = (low & 15) << 1
            low = ((low >> 4) | ((high & 15) << 12)) ^ table[entry]
            high = (high >> 4) ^ table[entry + 1]
        at += 1
    low ^= 0xFFFF
    high ^= 0xFFFF
    data[end] = low & 0xFF
    data[end + 1] = low >> 8
    data[end + 2] = high & 0xFF
    data[end + 3] = high >> 8


@micropython.viper
def sealed(table: ptr16, data: ptr8, start: int, end: int) -> int:
    """1 where the four bytes behind data[start:end] are its crc32, else 0."""
    low = 0xFFFF
    high = 0xFFFF
    at = start
    while at < end:
        low ^= data[at]
        for _ in range(2):
            entry = (low & 15) << 1
            low = ((low >> 4) | ((high & 15) << 12)) ^ table[entry]
            high = (high >> 4) ^ table[entry + 1]
        at += 1
    low ^= 0xFFFF
    high ^= 0xFFFF
    wrong = (low ^ (data[end] | (data[end + 1] << 8))) | (high ^ (data[end + 2] | (data[end + 3] << 8)))
    return 1 if wrong == 0 else 0


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
    for i in range(8):
        target[to + i] = raw[i]
    to = places >> 15
    counts = 8 + 4 * joints
    for at in range(8, counts, 4):
        for i in range(4):
            target[to + i] = raw[at + i]
            target[to + 4 + i] = raw[at + 4 * joints + i]
        to += 8


def places(to: int, at: int) -> int:
    """Both indices of ``copy`` in one small integer (viper functions take four arguments at most)."""
    return to | at << 15


def u32(data: "bytes | bytearray", at: int) -> int:
    """The unsigned word at data[at:at+4]; allocates only where it is 2**30 or more."""
    return data[at] | data[at + 1] << 8 | data[at + 2] << 16 | data[at + 3] << 24
