"""``dataclasses.dataclass`` whose methods are compiled when they are first used.

The standard one compiles up to six methods while a module is imported, 0.3 to 1 ms for each class, and a command
imports over a hundred classes and uses a few. Type checkers see the standard one.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import TYPE_CHECKING, Any


class Late:
    """A method of a class that is made when it is first looked up, and then takes this object's place."""

    def __init__(self, owner: type, name: str, make: Callable[[], Any]) -> None:
        self.owner, self.name, self.make = owner, name, make

    def __get__(self, instance: object, owner: type | None = None) -> Any:
        """The method, bound to ``instance``."""
        method = self.make()
        setattr(self.owner, self.name, method)
        return method.__get__(instance, owner)


def wrap_init(owner: type, wrap: Callable[[Callable[..., Any]], Callable[..., Any]]) -> None:
    """Put what ``wrap`` makes of a class's constructor in its place, when that is first used."""
    found = vars(owner).get("__init__")
    if isinstance(found, Late):
        wrapped: Any = Late(owner, "__init__", lambda: wrap(found.make()))
    else:
        wrapped = wrap(owner.__init__)  # type: ignore[misc]
    owner.__init__ = wrapped  # type: ignore[misc]


if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass
else:

    def dataclass(
        made: type | None = None,
        /,
        *,
        repr: bool = True,
        eq: bool = True,
        frozen: bool = False,
        **options: bool,
    ) -> Any:
        """As ``dataclasses.dataclass``, without ``init``, ``order`` and ``unsafe_hash``; a frozen class refuses every
        assignment, also of an attribute that is no field."""

        def decorated(made: type) -> type:
            own = set(vars(made))
            has_hash = vars(made).get("__hash__") is not None
            made = dataclasses.dataclass(init=False, repr=False, eq=False, **options)(made)
            wanted = {"__init__": {}}
            if repr:
                wanted["__repr__"] = {"repr": True}
            if eq:
                wanted["__eq__"] = {"eq": True}
                if frozen:
                    wanted["__hash__"] = {"unsafe_hash": True}
                elif not has_hash:
                    made.__hash__ = None
            for name in wanted.keys() - own:
                setattr(made, name, _late(made, name, frozen, wanted[name]))
            if frozen:
                made.__setattr__, made.__delattr__ = _refuse_to_set, _refuse_to_delete
            return made

        return decorated if made is None else decorated(made)


def _late(made: type, name: str, frozen: bool, options: dict[str, bool]) -> Late:
    """A method that the standard decorator makes, for a class with the same fields."""
    is_init = name == "__init__"

    def make() -> Any:
        fields = made.__dataclass_fields__  # type: ignore[attr-defined]
        space = {
            **fields,
            "__annotations__": {name: field.type for name, field in fields.items()},
            "__module__": made.__module__,
            "__qualname__": made.__qualname__,
            "__doc__": made.__doc__,
        }
        if hasattr(made, "__post_init__"):
            space["__post_init__"] = None  # the constructor calls that of the object
        wanted = {"init": is_init, "repr": False, "eq": False, "frozen": is_init and frozen, **options}
        return vars(dataclasses.dataclass(**wanted)(type(made.__name__, (), space)))[name]

    return Late(made, name, make)


def _refuse_to_set(self: object, name: str, value: object) -> None:
    raise dataclasses.FrozenInstanceError(f"cannot assign to field {name!r}")


def _refuse_to_delete(self: object, name: str) -> None:
    raise dataclasses.FrozenInstanceError(f"cannot delete field {name!r}")
