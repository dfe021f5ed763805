"""Parameters of a search by name: numbers within a range, and choices between words."""

from __future__ import annotations

from dataclasses import dataclass

Value = float | str


@dataclass(frozen=True)
class Number:
    """A number from ``least`` to ``most``, a whole one where the default is an int."""

    default: float
    least: float
    most: float
    meaning: str

    @property
    def allowed(self) -> str:
        """The range in words."""
        kind = "a whole number" if isinstance(self.default, int) else "a number"
        return f"{kind} from {self.least:g} to {self.most:g}"

    def admits(self, value: object) -> bool:
        """Whether ``value`` is of the kind and in the range."""
        if isinstance(value, bool) or not isinstance(
            value, int if isinstance(self.default, int) else int | float
        ):
            return False
        return self.least <= value <= self.most


@dataclass(frozen=True)
class OneOf:
    """One of several words."""

    default: str
    words: tuple[str, ...]
    meaning: str

    @property
    def allowed(self) -> str:
        """The words."""
        return "one of " + ", ".join(repr(word) for word in self.words)

    def admits(self, value: object) -> bool:
        """Whether ``value`` is one of the words."""
        return value in self.words


Parameter = Number | OneOf
