"""Stands in for MicroPython's ``micropython`` module when the board program runs under CPython.

Pointer annotations of ``@viper`` functions, and casts such as ``ptr32(address)`` inside them, get views that
behave like the chip's memory: 8, 16 or 32 bit wide, stores wrap, loads of ``ptr8`` and ``ptr16`` are
unsigned, loads of ``ptr32`` signed. Everything else
in a viper function is left as it is: board code keeps its words within 31 bits (or lets only a store wrap).
"""

from __future__ import annotations

import builtins
import ctypes
import functools
from collections.abc import Callable
from typing import Any, TypeVar

Function = TypeVar("Function", bound=Callable[..., Any])


class _Pointer:
    """Memory of an array or a buffer, or at an address, seen in words of ``width`` bytes, little endian."""

    width = 1
    signed = False
    reach = 4096  # bytes that can be reached from an address

    def __init__(self, target: Any, offset: int = 0) -> None:
        if isinstance(target, int):
            target = (ctypes.c_ubyte * self.reach).from_address(target)
        self._bytes = memoryview(target).cast("B")
        self._offset = offset

    def __int__(self) -> int:
        return ctypes.addressof(ctypes.c_char.from_buffer(self._bytes)) + self._offset

    def __getitem__(self, index: int) -> int:
        at = self._offset + index * self.width
        return int.from_bytes(self._bytes[at : at + self.width], "little", signed=self.signed)

    def __setitem__(self, index: int, value: int) -> None:
        at = self._offset + index * self.width
        masked = value & ((1 << 8 * self.width) - 1)
        self._bytes[at : at + self.width] = masked.to_bytes(self.width, "little")


class _Pointer16(_Pointer):
    width = 2


class _Pointer32(_Pointer):
    """The one that loops run on: as quick as it gets."""

    width = 4
    signed = True

    def __init__(self, target: Any, offset: int = 0) -> None:
        super().__init__(target, offset)
        whole = (len(self._bytes) - offset) & ~3
        self._words = self._bytes[offset : offset + whole].cast("i")

    def __getitem__(self, index: int) -> int:
        return self._words[index]

    def __setitem__(self, index: int, value: int) -> None:
        if not -0x80000000 <= value <= 0x7FFFFFFF:
            value = ((value + 0x80000000) & 0xFFFFFFFF) - 0x80000000
        self._words[index] = value


_POINTERS: dict[str, type[_Pointer]] = {"ptr8": _Pointer, "ptr16": _Pointer16, "ptr32": _Pointer32}


def const(value: Any) -> Any:
    """A constant that MicroPython's compiler would fold."""
    return value


def native(function: Function) -> Function:
    """No machine code here: the function itself."""
    return function


def viper(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function with its pointer arguments turned into views of memory."""
    names = function.__code__.co_varnames[: function.__code__.co_argcount]
    kinds = [_pointer_type(function.__annotations__.get(name)) for name in names]
    places = [(place, kind) for place, kind in enumerate(kinds) if kind is not None]

    @functools.wraps(function)
    def call(*arguments: Any) -> Any:
        values = list(arguments)
        for place, kind in places:
            values[place] = kind(values[place])
        return function(*values)

    return call


def _pointer_type(annotation: Any) -> type[_Pointer] | None:
    return _POINTERS.get(getattr(annotation, "__name__", annotation))


def _uint(value: Any) -> int:
    return int(value) & 0xFFFFFFFF


for _name, _kind in _POINTERS.items():
    _kind.__name__ = _name  # as annotations name them
    setattr(builtins, _name, _kind)
builtins.uint = _uint  # type: ignore[attr-defined]
