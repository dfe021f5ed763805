"""Stands in for MicroPython's ``uctypes`` under CPython: addresses of buffers, and buffers at addresses."""

from __future__ import annotations

import ctypes
from typing import Any


def addressof(buffer: Any) -> int:
    """Address of a writable buffer's first byte; valid as long as the buffer lives and keeps its size."""
    size = len(memoryview(buffer).cast("B"))
    return ctypes.addressof((ctypes.c_ubyte * size).from_buffer(buffer))


def bytearray_at(address: int, size: int) -> memoryview:
    """The memory at an address."""
    return memoryview((ctypes.c_ubyte * size).from_address(address)).cast("B")
