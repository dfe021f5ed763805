"""What both ways of planning hand on."""

from __future__ import annotations

from dataclasses import dataclass

from armtempo.model.plan import Search
from armtempo.splines.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class Planned:
    """A trajectory, how it was found, and what the user must know of it."""

    trajectory: Trajectory
    searches: tuple[Search, ...]
    notes: tuple[str, ...]
