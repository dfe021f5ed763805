"""Replaces MicroPython's ``micropython`` module when the board program runs under CPython.

Pointer arguments of ``@viper`` functions, and casts such as ``ptr32(address)`` in them, become views of memory
that behave as on the chip: 8, 16 or 32 bits wide; stores wrap; loads of ``ptr8`` and ``ptr16`` are unsigned,
those of ``ptr32`` signed. The rest of a viper function is ordinary Python, so board code keeps its words
within 31 bits (or lets only a store wrap).
"""

from __future__ import annotations

import builtins
import ctypes
import functools
from array import array
from collections.abc import Callable
from types import FunctionType
from typing import Any, TypeVar

from pointers import by_index  # type: ignore[import-not-found]  # beside this file, which is on the path

Function = TypeVar("Function", bound=Callable[..., Any])
_REACH = 8192  # bytes that can be reached from an address
_MOST_KEPT = 4096
_MANY_CALLS = 300
"""After these a function is rewritten (pointers.py), which takes as long as it saves in about as many calls."""


def _address(pointer: Any) -> int:
    return ctypes.addressof(pointer)


def _caster(cell: type[Any]) -> Callable[[Any], Any]:
    """A cast to a pointer: a ctypes array with its address; its stores wrap.

    Pointers are cached, as most calls pass the same addresses and arrays.
    """
    width = ctypes.sizeof(cell)
    kept: dict[int, Any] = {}
    alive: list[Any] = []  # the targets: after one is freed, another object may have its id

    @functools.cache
    def kind(count: int) -> Any:
        return type("Pointer", (cell * count,), {"__int__": _address, "__slots__": ()})

    def cast(target: Any) -> Any:
        key = ~target if target.__class__ is int else id(target)
        known = kept.get(key)
        if known is not None:
            return known
        if key < 0:
            pointer = kind(_REACH // width).from_address(target)
        else:
            view = memoryview(target).cast("B")
            pointer = kind(len(view) // width)
            pointer = pointer.from_buffer_copy(view) if view.readonly else pointer.from_buffer(view)
        if key < 0 or isinstance(target, (array, memoryview)):  # a bytearray could no longer be resized
            if len(kept) >= _MOST_KEPT:
                kept.clear()
                alive.clear()
            kept[key] = pointer
            alive.append(target)
        return pointer

    return cast


_CASTS = {
    "ptr8": _caster(ctypes.c_uint8),
    "ptr16": _caster(ctypes.c_uint16),
    "ptr32": _caster(ctypes.c_int32),
}


def const(value: Any) -> Any:
    """The value itself; MicroPython's compiler folds it."""
    return value


def native(function: Function) -> Function:
    """The function itself."""
    return function


def viper(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function, with its pointer arguments converted to views of memory."""
    names = function.__code__.co_varnames[: function.__code__.co_argcount]
    casts = {name: _cast_of(function.__annotations__.get(name)) for name in names}
    values = [f"cast_{name}({name})" if casts[name] else name for name in names]
    known = {f"cast_{name}": cast for name, cast in casts.items()}
    known["function"] = function
    if isinstance(function, FunctionType):
        calls = 0

        def first_calls(*arguments: Any) -> Any:
            nonlocal calls
            calls += 1
            if calls == _MANY_CALLS:
                known["function"] = by_index(function)
            return function(*arguments)

        known["function"] = first_calls
    # with exactly these arguments: *args would cost more than the casts
    call = eval(f"lambda {', '.join(names)}: function({', '.join(values)})", known)
    return functools.wraps(function)(call)


def _cast_of(annotation: Any) -> Callable[[Any], Any] | None:
    return _CASTS.get(getattr(annotation, "__name__", annotation))


def _uint(value: Any) -> int:
    return int(value) & 0xFFFFFFFF


for _name, _cast in _CASTS.items():
    _cast.__name__ = _name  # as annotations name them
    setattr(builtins, _name, _cast)
builtins.uint = _uint  # type: ignore[attr-defined]
