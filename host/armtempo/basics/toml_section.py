"""A table of a TOML file as a dataclass: each field has the meaning and the allowed values of its key."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import MISSING, Field, dataclass, fields
from typing import TYPE_CHECKING, Any, TypeVar

from armtempo.basics.errors import InputError
from armtempo.basics.toml_table import Table

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

    Part = TypeVar("Part", bound=DataclassInstance)


@dataclass(frozen=True)
class Key:
    """The meaning of a key, for the reference page, and its least and largest value or its choices."""

    meaning: str
    least: float = -math.inf
    most: float = math.inf
    choices: tuple[Any, ...] = ()


def key(
    meaning: str, least: float = -math.inf, most: float = math.inf, choices: tuple[Any, ...] = ()
) -> Mapping[str, Any]:
    """The metadata of a dataclass's field that is a key of a file."""
    return {"key": Key(meaning, least, most, choices)}


def keys(part: type[DataclassInstance] | DataclassInstance) -> list[tuple[Field[Any], Key]]:
    """The fields of a part that are keys of a file."""
    return [(one, one.metadata["key"]) for one in fields(part) if "key" in one.metadata]


def read(part: type[Part], table: Table, called: Callable[[str], str] = str, **others: Any) -> Part:
    """The part that a table describes; ``called``: the key of a field; ``others``: fields that the caller reads.

    InputError, naming file, key and value, for anything missing, unknown or not allowed.
    """
    values = {
        one.name: _value(table, called(one.name), one, known)
        for one, known in keys(part)
        if one.name not in others
    }
    table.done()
    return part(**others, **values)


def _value(table: Table, name: str, one: Field[Any], known: Key) -> Any:
    default = () if one.default is MISSING else (one.default,)
    if known.choices:
        return table.choice(name, known.choices, *default)
    if one.type == "bool":
        return table.boolean(name, one.default)  # type: ignore[arg-type]
    if one.type == "int":
        return table.integer(name, *default, least=int(known.least), most=int(known.most))
    return table.number(name, *default, least=known.least, most=known.most)


def check(part: DataclassInstance) -> None:
    """Raise InputError for a value that would be refused in a file."""
    for one, known in keys(part):
        value = getattr(part, one.name)
        said = f"{type(part).__name__}: {one.name} is"
        if known.choices and value not in known.choices:
            raise InputError(f"{said} {value!r}", f"give {' or '.join(map(repr, known.choices))}")
        if not known.choices and not known.least <= value <= known.most:
            raise InputError(f"{said} {value:g}", f"give {known.least:g} to {known.most:g}")
