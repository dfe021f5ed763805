"""Adds MicroPython's extensions of ``time``, ``gc`` and ``sys`` to CPython's modules."""

from __future__ import annotations

import gc
import sys
import time
import traceback
from typing import Any, TextIO

_PERIOD = 1 << 30
_HEAP_BYTES = 100_000


def _ticks_us() -> int:
    return time.monotonic_ns() // 1000 % _PERIOD


def _ticks_diff(end: int, start: int) -> int:
    return (end - start + _PERIOD // 2) % _PERIOD - _PERIOD // 2


def _print_exception(error: BaseException, file: TextIO = sys.stderr) -> None:
    traceback.print_exception(error, file=file)


def _collect() -> int:
    """Does nothing: there is enough memory, and a collection takes long."""
    return 0


def _mem_free() -> int:
    return _HEAP_BYTES


def _threshold(amount: int | None = None) -> int | None:
    return -1 if amount is None else None


def _mem_alloc() -> int:
    return 0


_ADDITIONS: tuple[tuple[Any, str, Any], ...] = (
    (time, "ticks_us", _ticks_us),
    (time, "ticks_diff", _ticks_diff),
    (sys, "print_exception", _print_exception),
    (gc, "collect", _collect),
    (gc, "mem_free", _mem_free),
    (gc, "mem_alloc", _mem_alloc),
    (gc, "threshold", _threshold),
)
for _module, _name, _function in _ADDITIONS:
    setattr(_module, _name, _function)
