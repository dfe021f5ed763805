"""Dataclasses to JSON values and back; reading refuses values that do not fit the types.

A missing key is refused, except for a field marked ``ADDED`` or by ``added_as``: files written before it existed get
its default, or the value that had been meant.
"""

from __future__ import annotations

import dataclasses
import types
from collections.abc import Callable, Mapping
from typing import Any, Union, get_args, get_origin, get_type_hints

import numpy as np

from armtempo.basics.errors import InputError
from armtempo.basics.kinds import is_number, is_whole
from armtempo.basics.text import did_you_mean, visible

_AGAIN = "restore the file from a copy, or make it again with the command that wrote it"
KEY = "json_key"
"""Metadata of a field: its key in JSON, if that is not its name."""
ADDED = {"added": True}
"""Metadata of a dataclass field that older files do not have; they get its default."""


def added_as(value: Any) -> dict[str, Any]:
    """Metadata of such a field whose default differs from what files without it meant: ``value``."""
    return {**ADDED, "before": value}


def encode(value: Any) -> Any:
    """JSON value of dataclasses, mappings, tuples, arrays and plain values."""
    if dataclasses.is_dataclass(value):
        return {_key(field): encode(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, Mapping):
        return {key: encode(entry) for key, entry in value.items()}
    if isinstance(value, (tuple, list)):
        return [encode(entry) for entry in value]
    return value


def decode(kind: Any, value: Any, where: str) -> Any:
    """Convert a ``value`` read from JSON to an object of type ``kind``.

    ``where`` names the place for the message. Raises InputError for a missing or unknown key, or a value of
    another type.
    """
    origin = get_origin(kind)
    if origin in (Union, types.UnionType):
        return _union(kind, value, where)
    if origin is tuple:
        return _tuple(kind, value, where)
    if origin is not None and issubclass(origin, Mapping):
        return _mapping(kind, value, where)
    if origin is np.ndarray:
        return _array(value, where)
    if dataclasses.is_dataclass(kind):
        return _dataclass(kind, value, where)
    return _plain(kind, value, where)


def _plain(kind: Any, value: Any, where: str) -> Any:
    if kind is float and is_whole(value) and is_number(value):
        return float(value)
    if type(value) is not (types.NoneType if kind is None else kind):
        raise InputError(f"{where}: {_short(value)} should be {_name(kind)}", _AGAIN)
    if kind is float and not is_number(value):
        raise InputError(f"{where}: {value} is not a finite number", _AGAIN)
    if type(value) is str and visible(value) != value:
        raise InputError(f"{where}: {_short(value)} has control characters", _AGAIN)
    return value


def _union(kind: Any, value: Any, where: str) -> Any:
    tables = [option for option in get_args(kind) if dataclasses.is_dataclass(option)]
    if len(tables) == 1 and isinstance(value, dict):
        return decode(tables[0], value, where)  # its error is more specific
    for option in get_args(kind):
        try:
            return decode(option, value, where)
        except InputError:
            continue
    raise InputError(f"{where}: {_short(value)} should be {_name(kind)}", _AGAIN)


def _tuple(kind: Any, value: Any, where: str) -> tuple[Any, ...]:
    kinds = get_args(kind)
    if not isinstance(value, list):
        raise InputError(f"{where}: {_short(value)} should be a list", _AGAIN)
    if kinds[-1] is Ellipsis:
        kinds = (kinds[0],) * len(value)
    if len(kinds) != len(value):
        raise InputError(f"{where}: has {len(value)} entries, should have {len(kinds)}", _AGAIN)
    return tuple(decode(k, v, f"{where}[{i}]") for i, (k, v) in enumerate(zip(kinds, value, strict=True)))


def _mapping(kind: Any, value: Any, where: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise InputError(f"{where}: {_short(value)} should be a table", _AGAIN)
    return {key: decode(get_args(kind)[1], entry, f"{where}.{key}") for key, entry in value.items()}


def _array(value: Any, where: str) -> Any:
    try:
        array = np.array(value)
    except ValueError:
        raise InputError(f"{where}: the rows differ in length", _AGAIN) from None
    if array.dtype.kind not in "if" or not np.all(np.isfinite(array)):
        raise InputError(f"{where}: should be a list of finite numbers", _AGAIN)
    return array.astype(float)


def _dataclass(kind: Any, value: Any, where: str) -> Any:
    if not isinstance(value, dict):
        raise InputError(f"{where}: {_short(value)} should be a table", _AGAIN)
    value = {**_before(kind), **value}
    fields = {_key(field): field for field in dataclasses.fields(kind)}
    missing = {key for key, field in fields.items() if key not in value and not field.metadata.get("added")}
    for what, keys in (("unknown", value.keys() - fields.keys()), ("missing", missing)):
        if keys:
            meant = did_you_mean(min(keys), fields) if what == "unknown" else ""
            raise InputError(f"{where}: {what} key {', '.join(sorted(keys))}{meant}", _AGAIN)
    hints = _hints(kind)
    found = {
        field.name: decode(hints[field.name], value[key], f"{where}.{key}")
        for key, field in fields.items()
        if key in value
    }
    try:
        return kind(**found)
    except InputError as error:
        raise InputError(f"{where}: {error.problem}", error.hint) from None


def _before(kind: Any) -> dict[str, Any]:
    """What older files meant without a key, where that is not its default now."""
    return {
        _key(field): field.metadata["before"]
        for field in dataclasses.fields(kind)
        if "before" in field.metadata
    }


def _key(field: dataclasses.Field[Any]) -> str:
    return str(field.metadata.get(KEY, field.name))


_hints: Callable[[Any], dict[str, Any]] = get_type_hints


def _name(kind: Any) -> str:
    return getattr(kind, "__name__", str(kind))


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) < 40 else text[:36] + " ..."
