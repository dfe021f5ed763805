"""Checks of the arguments of public calls against their annotations, with an InputError that says what to give."""

from __future__ import annotations

import dataclasses
import inspect
import reprlib
from collections.abc import Callable, Mapping, Sequence
from functools import cache, wraps
from itertools import chain, repeat
from operator import call
from types import SimpleNamespace, UnionType
from typing import Any, TypeVar, Union, cast, get_args, get_origin, get_type_hints

import numpy as np

from armtempo.basics.errors import InputError
from armtempo.basics.kinds import is_number, is_text, is_whole
from armtempo.basics.text import hidden

T = TypeVar("T")

_SIMPLE = {
    str: "a text",
    int: "a whole number",
    float: "a finite number",
    bool: "True or False",
    type(None): "None",
}


def checked(target: T) -> T:
    """Decorate a function (or a class: its public methods and constructor) to check arguments by their annotations.

    ``ArrayLike`` and ``Array`` take finite numbers only.
    """
    if not isinstance(target, type):
        return _wrapped(target)  # type: ignore[arg-type, return-value]
    return checked_as(target.__name__)(target)


def checked_as(owner: str) -> Callable[[T], T]:
    """The same for a class whose methods users call by the class ``owner``, which errors name."""
    return lambda target: _checked_methods(target, owner)


def _checked_methods(target: T, owner: str) -> T:
    for name, entry in [*vars(target).items()]:
        if isinstance(entry, classmethod) and not name.startswith("_"):
            setattr(target, name, classmethod(_wrapped(entry.__func__, owner)))
        elif inspect.isfunction(entry) and (name == "__call__" or not name.startswith("_")):
            setattr(target, name, _wrapped(entry, owner))
    return target


def checked_fields(target: type[T]) -> type[T]:
    """A data class whose fields are checked when an object is made."""
    target.__init__ = _wrapped(target.__init__, target.__name__)  # type: ignore[method-assign]
    return target


def _wrapped(function: Callable[..., Any], owner: str = "") -> Callable[..., Any]:
    name = owner if function.__name__ == "__init__" else f"{owner}.{function.__name__}".lstrip(".")

    @wraps(function)
    def call(*arguments: Any, **named: Any) -> Any:
        places, rest, kinds, checks = _annotated(function)
        for argument, value in zip(chain(places, repeat(rest)) if rest else places, arguments, strict=False):
            if not checks[argument](value):
                raise _wrong(name, argument, value, kinds[argument])
        for argument, value in named.items():
            if argument in checks and not checks[argument](value):
                raise _wrong(name, argument, value, kinds[argument])
        return function(*arguments, **named)

    return call


def _wrong(name: str, argument: str, value: object, kind: Any) -> InputError:
    if isinstance(value, str) and (character := hidden(value)) and fits("", kind):
        return InputError(
            f"{name}: {argument} has the character {character}, which cannot be shown: {reprlib.repr(value)}",
            "take it out; if it is in the name of a file, rename the file",
        )
    return InputError(f"{name}: {argument} is {reprlib.repr(value)}", f"give {describe_kind(kind)}")


@cache
def _annotated(
    function: Callable[..., Any],
) -> tuple[list[str], str, dict[str, Any], dict[str, Callable[[object], bool]]]:
    """Names of the positional arguments, name of the variable one ("" if none), and types and checks of all.

    Arrays have the type ``Numbers``; what takes a ``Where`` or an ``AnyProgram`` checks it itself.
    """
    arrays: dict[str, Any] = {"ArrayLike": Numbers, "Array": Numbers, "Where": Any, "AnyProgram": Any}
    code = function.__code__
    rest = code.co_varnames[code.co_argcount + code.co_kwonlyargcount] if code.co_flags & _TAKES_MORE else ""
    kinds = dict.fromkeys((*code.co_varnames[: code.co_argcount], rest), Any)
    given = {name: kind for name, kind in function.__annotations__.items() if name != "return"}
    kinds |= get_type_hints(
        SimpleNamespace(__annotations__=given), inspect.unwrap(function).__globals__, arrays
    )
    checks = {argument: _check(kind) for argument, kind in kinds.items()}
    return [*code.co_varnames[: code.co_argcount]], rest, kinds, checks


_TAKES_MORE = inspect.CO_VARARGS


class Numbers:
    """Type for arrays (or nested lists) of finite numbers."""


def fits(value: object, kind: Any) -> bool:
    """Whether a value fits an annotation."""
    return _check(kind)(value)


@cache
def _check(kind: Any) -> Callable[[object], bool]:
    origin, inner = get_origin(kind) or kind, get_args(kind)
    if kind in _PLAIN:
        return _PLAIN[kind]
    if origin in (Union, UnionType):
        checks = [_check(one) for one in inner]
        return lambda value: any(map(call, checks, repeat(value)))
    if isinstance(kind, dataclasses.InitVar):
        return _check(cast(Any, kind.type))
    if origin is Callable:
        return callable
    if origin in (tuple, Sequence):
        return lambda value: _entries_fit(value, origin, inner)
    if origin is Mapping:
        return lambda value: isinstance(value, Mapping) and all(map(_check(inner[1]), value.values()))
    return lambda value: isinstance(value, origin)


def _are_numbers(value: object) -> bool:
    try:
        array = np.asarray(value)
        return array.dtype.kind in "iuf" and np.count_nonzero(np.isfinite(array)) == array.size
    except (ValueError, TypeError, OverflowError):
        return False


_PLAIN: dict[Any, Callable[[object], bool]] = {
    Any: lambda _: True,
    Numbers: _are_numbers,
    None: lambda value: value is None,
    type(None): lambda value: value is None,
    bool: lambda value: type(value).__name__ in ("bool", "bool_"),
    int: is_whole,
    float: is_number,
    str: is_text,
}


def _entries_fit(value: object, origin: Any, kinds: Sequence[Any]) -> bool:
    entries = value.tolist() if isinstance(value, np.ndarray) else value
    if not isinstance(entries, list | tuple):
        return False
    if origin is tuple and kinds[-1] is not Ellipsis:
        return len(entries) == len(kinds) and all(map(fits, entries, kinds))
    return all(map(_check(kinds[0]), entries))


def describe_kind(kind: Any) -> str:
    """Describe a type."""
    origin, inner = get_origin(kind) or kind, get_args(kind)
    if kind in _SIMPLE:
        return _SIMPLE[kind]
    if kind is Numbers:
        return "finite numbers"
    if origin in (Union, UnionType):
        return " or ".join(dict.fromkeys(describe_kind(one) for one in inner))
    if isinstance(kind, dataclasses.InitVar):
        return describe_kind(kind.type)
    if origin is Callable:
        return "a function"
    if origin is tuple and inner[-1] is not Ellipsis:
        return f"({', '.join(describe_kind(one) for one in inner)})"
    if origin in (tuple, Sequence):
        return f"a list, each entry {describe_kind(inner[0])}"
    if origin is Mapping:
        return f"a dictionary, each value {describe_kind(inner[1])}"
    return "a path" if origin.__name__ == "Path" else f"an object of type {origin.__name__}"
