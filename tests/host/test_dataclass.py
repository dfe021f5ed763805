"""Data classes whose methods are compiled at their first use, beside the standard ones."""

from __future__ import annotations

import dataclasses
import pickle
from abc import ABC, abstractmethod
from dataclasses import KW_ONLY, FrozenInstanceError, InitVar, field
from functools import cached_property
from typing import Any, ClassVar

import pytest
from armtempo.basics.arguments import checked_fields
from armtempo.basics.dataclass import dataclass
from armtempo.basics.errors import InputError


class Named(ABC):
    @abstractmethod
    def name(self) -> str:
        """Of the object."""


def made(decorate: Any) -> tuple[type, type]:
    """The same two classes, by either decorator."""

    @decorate(frozen=True)
    class First(Named):
        """With fields of all kinds."""

        number: int
        more: tuple[int, ...] = field(default=(), repr=False)
        kind: ClassVar[str] = "first"
        _: KW_ONLY
        scale: InitVar[float] = 2.0
        found: list[int] = field(default_factory=list, compare=False)

        def __post_init__(self, scale: float) -> None:
            self.found.append(int(scale * self.number))

        def name(self) -> str:
            return self.kind

        @cached_property
        def twice(self) -> int:
            return 2 * self.number

    @decorate(frozen=True)
    class Second(First):
        """With one more."""

        last: str = "z"

        def __repr__(self) -> str:
            return f"<{self.last}>"

    return First, Second


ARGUMENTS = [((1,), {}), ((1, (2,)), {"scale": 3.0}), ((2,), {"found": [5]})]


def test_as_the_standard_ones() -> None:
    for mine, standard in zip(made(dataclass), made(dataclasses.dataclass), strict=True):
        ours = [mine(*some, **named) for some, named in ARGUMENTS]
        theirs = [standard(*some, **named) for some, named in ARGUMENTS]
        for one, other in zip(ours, theirs, strict=True):
            assert repr(one) == repr(other)
            assert dataclasses.asdict(one) == dataclasses.asdict(other)
            assert (hash(one), one.twice, one.name()) == (hash(other), other.twice, other.name())
            assert dataclasses.replace(one, number=7, scale=1.0) == mine(7, one.more, scale=1.0)
            for change in (lambda one=one: setattr(one, "number", 3), lambda one=one: delattr(one, "number")):
                with pytest.raises(FrozenInstanceError, match="number"):
                    change()
        assert [[one == other for other in ours] for one in ours] == [
            [one == other for other in theirs] for one in theirs
        ]
        assert ours[0] != theirs[0]
        with pytest.raises(TypeError, match="number"):
            mine()


def test_equal_and_changed() -> None:
    @dataclass
    class Counted:
        number: int = 0

    one = Counted()
    one.number = 4
    assert one == Counted(4)
    with pytest.raises(TypeError, match="unhashable"):
        hash(one)

    @dataclass(eq=False, slots=True)
    class Slotted:
        number: int

    assert Slotted(3).number == 3
    assert Slotted(3) != Slotted(3)
    assert not hasattr(Slotted(3), "__dict__")


@checked_fields
@dataclass(frozen=True)
class Checked:
    """With fields that are checked."""

    number: int


def test_compiled_at_the_first_use(monkeypatch: pytest.MonkeyPatch) -> None:
    compiled = []

    def counted(*given: Any) -> None:
        compiled.append(given)
        exec(*given)

    monkeypatch.setattr(dataclasses, "exec", counted, raising=False)
    first, second = made(dataclass)
    checked_fields(first)
    assert not compiled
    second(1)
    assert compiled
    once = len(compiled)
    second(2)
    assert len(compiled) == once


def test_checked_fields_are_checked() -> None:
    assert pickle.loads(pickle.dumps(Checked(3))) == Checked(3)
    with pytest.raises(InputError, match="Checked: number is 'x'"):
        Checked("x")  # type: ignore[arg-type]
