"""A finished plan: the trajectory with all that led to it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.splines.bspline import Array
from armtempo.splines.extremes import Extremes
from armtempo.splines.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class Search:
    """How the time axis of one joint, or the shared one, was found."""

    joints: tuple[int, ...]
    """Indices, among the driven joints, of those that the axis serves."""
    intervals_s: Array
    """What was varied: the intervals X (n,), or with refinement all differences of time control points."""
    total_s: float
    """The motion time."""
    searched_s: float
    """What the search alone reached, without polish or refinement."""
    evaluations: int
    """Fitness evaluations of the search."""
    history_s: Array
    """Best fitness of the first population and after each iteration, (iterations + 1,)."""
    optimum_s: float
    """Where polished: bound from below on the local optimum with as many intervals; else 0."""
    floor_s: float
    """No time law along this path keeps the limits in less (kind "path": to about 1 ms)."""
    floor_kind: str
    """How the floor was found, see ``floors.floor``."""


@dataclass(frozen=True, eq=False)
class Plan:
    """A motion for ``arm`` that does ``job`` and keeps every limit; ``versions`` made it."""

    arm: Arm
    job: Job
    via_deg: Array
    """Angles of the driven joints at the via points, (n + 1, J)."""
    notes: tuple[str, ...]
    """What the user must know of how poses became angles."""
    trajectory: Trajectory
    searches: tuple[Search, ...]
    """One for each joint that moves, or one for the shared time axis."""
    extremes: tuple[Extremes, ...]
    """For each driven joint."""
    versions: Mapping[str, str]
