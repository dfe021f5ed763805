"""Stands in for MicroPython's ``micropython`` module when the board program runs under CPython.

Pointer annotations of ``@viper`` functions, and casts such as ``ptr32(address)`` inside them, get views that
behave like the chip's memory: 8, 16 or 32 bit wide, stores wrap, loads of ``ptr8`` and ``ptr16`` are
unsigned, loads of ``ptr32`` signed. Everything else in a viper function is left as it is: board code keeps
its words within 31 bits (or lets only a store wrap).
"""

from __future__ import annotations

import builtins
import ctypes
import functools
from array import array
from collections.abc import Callable
from typing import Any, Literal, TypeVar

Function = TypeVar("Function", bound=Callable[..., Any])
_REACH = 8192  # bytes that can be reached from an address
_MOST_KEPT = 4096


class _Pointer:
    """Memory seen in words of one width, little endian."""

    __slots__ = ("_words",)

    def __init__(self, words: memoryview) -> None:
        self._words = words

    def __int__(self) -> int:
        return ctypes.addressof(ctypes.c_char.from_buffer(self._words.cast("B")))

    def __getitem__(self, index: int) -> int:
        return int(self._words[index])

    def __setitem__(self, index: int, value: int) -> None:
        self._words[index] = value & ((1 << 8 * self._words.itemsize) - 1)


class _Pointer32(_Pointer):
    """The one that loops run on: as quick as it gets."""

    __slots__ = ()

    def __getitem__(self, index: int) -> int:
        return self._words[index]

    def __setitem__(self, index: int, value: int) -> None:
        if not -0x80000000 <= value <= 0x7FFFFFFF:
            value = ((value + 0x80000000) & 0xFFFFFFFF) - 0x80000000
        self._words[index] = value


def _caster(kind: type[_Pointer], cell: Literal["B", "H", "i"], width: int) -> Callable[[Any], _Pointer]:
    """A cast to a pointer. Pointers to addresses and arrays are kept: most calls come with the same ones."""
    kept: dict[int, _Pointer] = {}
    alive: list[Any] = []  # what they point at: another object may take the number of one that is gone

    def cast(target: Any) -> _Pointer:
        key = ~target if target.__class__ is int else id(target)
        known = kept.get(key)
        if known is not None:
            return known
        memory = (ctypes.c_ubyte * _REACH).from_address(target) if key < 0 else target
        view = memoryview(memory).cast("B")
        pointer = kind(view[: len(view) // width * width].cast(cell))
        if key < 0 or isinstance(target, (array, memoryview)):  # a bytearray may want to grow
            if len(kept) >= _MOST_KEPT:
                kept.clear()
                alive.clear()
            kept[key] = pointer
            alive.append(target)
        return pointer

    return cast


_CASTS = {
    "ptr8": _caster(_Pointer, "B", 1),
    "ptr16": _caster(_Pointer, "H", 2),
    "ptr32": _caster(_Pointer32, "i", 4),
}


def const(value: Any) -> Any:
    """A constant that MicroPython's compiler would fold."""
    return value


def native(function: Function) -> Function:
    """No machine code here: the function itself."""
    return function


def viper(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function with its pointer arguments turned into views of memory."""
    names = function.__code__.co_varnames[: function.__code__.co_argcount]
    kinds = [_cast_of(function.__annotations__.get(name)) for name in names]
    places = [(place, kind) for place, kind in enumerate(kinds) if kind is not None]

    @functools.wraps(function)
    def call(*arguments: Any) -> Any:
        values = list(arguments)
        for place, cast in places:
            values[place] = cast(values[place])
        return function(*values)

    return call


def _cast_of(annotation: Any) -> Callable[[Any], _Pointer] | None:
    return _CASTS.get(getattr(annotation, "__name__", annotation))


def _uint(value: Any) -> int:
    return int(value) & 0xFFFFFFFF


for _name, _cast in _CASTS.items():
    _cast.__name__ = _name  # as annotations name them
    setattr(builtins, _name, _cast)
builtins.uint = _uint  # type: ignore[attr-defined]
