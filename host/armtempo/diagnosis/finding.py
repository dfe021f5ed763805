"""What an examination found, of a file, a machine or a board: how bad, where, what, and what to do about it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Level(Enum):
    """How bad a finding is."""

    ERROR = "error"
    """It cannot work, or would do something else than the file says."""
    WARNING = "warning"
    """It may work, but is probably not meant so."""
    NOTE = "note"
    """Worth knowing; nothing looks wrong."""
    GOOD = "ok"

    @property
    def word(self) -> str:
        """The level if something works or does not, as on a machine: ``ok``, ``note`` or ``wrong``."""
        return "wrong" if self is Level.ERROR else self.value


@dataclass(frozen=True)
class Finding:
    """One thing found."""

    level: Level
    where: str
    """The joint, the part of the file, the package, the port."""
    what: str
    next_step: str = ""


def error(where: str, what: str, next_step: str) -> Finding:
    """A finding that prevents use."""
    return Finding(Level.ERROR, where, what, next_step)


def warning(where: str, what: str, next_step: str) -> Finding:
    """A finding that looks wrong."""
    return Finding(Level.WARNING, where, what, next_step)


def note(where: str, what: str, next_step: str) -> Finding:
    """A finding that is worth knowing."""
    return Finding(Level.NOTE, where, what, next_step)


def good(where: str, what: str) -> Finding:
    """A finding that is as it should be."""
    return Finding(Level.GOOD, where, what)
