"""Findings of a check: severity, place, problem, advice."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Level(Enum):
    """Severity of a finding."""

    ERROR = "error"
    """It cannot work, or does not do what the file says."""
    WARNING = "warning"
    """It may work, but is probably a mistake."""
    NOTE = "note"
    """Information only."""
    GOOD = "ok"

    @property
    def word(self) -> str:
        """The level as a word of ``doctor``: ``ok``, ``note`` or ``wrong``."""
        return "wrong" if self is Level.ERROR else self.value


@dataclass(frozen=True)
class Finding:
    """One finding."""

    level: Level
    where: str
    """The joint, the part of the file, the package, the port."""
    what: str
    next_step: str = ""


def error(where: str, what: str, next_step: str) -> Finding:
    """A finding that prevents use."""
    return Finding(Level.ERROR, where, what, next_step)


def warning(where: str, what: str, next_step: str) -> Finding:
    """A finding about a probable mistake."""
    return Finding(Level.WARNING, where, what, next_step)


def note(where: str, what: str, next_step: str) -> Finding:
    """A finding for information."""
    return Finding(Level.NOTE, where, what, next_step)


def good(where: str, what: str) -> Finding:
    """A finding without a problem."""
    return Finding(Level.GOOD, where, what)
