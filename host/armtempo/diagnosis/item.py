"""One line of the examination."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Condition(Enum):
    """How a line is meant."""

    GOOD = "ok"
    NOTE = "note"
    """Something optional is not there."""
    WRONG = "wrong"


@dataclass(frozen=True)
class Item:
    """What was looked at, what was found, and what to do where that is not good."""

    what: str
    found: str
    level: Condition = Condition.GOOD
    next_step: str = ""
