"""Replaces MicroPython's ``uctypes`` under CPython: addresses of buffers, buffers and words at addresses."""

from __future__ import annotations

import ctypes
from typing import Any

ARRAY = -1 << 30
INT32 = 5 << 27
_COUNT = (1 << 27) - 1


def addressof(buffer: Any) -> int:
    """Address of a writable buffer's first byte; valid as long as the buffer lives and keeps its size."""
    size = len(memoryview(buffer).cast("B"))
    return ctypes.addressof((ctypes.c_ubyte * size).from_buffer(buffer))


def bytearray_at(address: int, size: int) -> memoryview:
    """The memory at an address."""
    return memoryview((ctypes.c_ubyte * size).from_address(address)).cast("B")


def struct(address: int, descriptor: tuple[int, int]) -> memoryview:
    """Signed words at an address; the only supported ``descriptor`` is ``(ARRAY, count | INT32)``."""
    kind, items = descriptor
    assert kind == ARRAY
    assert items & ~_COUNT == INT32
    return bytearray_at(address, 4 * (items & _COUNT)).cast("i")
