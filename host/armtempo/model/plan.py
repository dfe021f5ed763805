"""A finished plan: the trajectory with all that led to it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.formats import json_codec
from armtempo.model.arm import Arm
from armtempo.model.job import Job
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
    """Best fitness of the first population and after each iteration, (iterations + 1,); of a gradient search the best
    motion time after each start."""
    optimum_s: float
    """Where polished: lower bound of the local optimum with as many intervals; else 0."""
    floor_s: float
    """Proven lower bound of the motion time, whatever the time law along this path; for a free path, whatever the path
    through the via points."""
    floor_kind: str
    """How the lower bound was found, see ``lower_bounds.Floor``."""
    starts_s: Array = field(default_factory=lambda: np.empty(0), metadata=json_codec.ADDED)
    """Of a gradient search, the motion time that each start led to on few segments; else empty."""


@dataclass(frozen=True, eq=False)
class Plan:
    """A motion for ``arm`` that does ``job`` and keeps every limit.

    ``trajectory(time_s, order)`` gives the angles of the driven joints or their derivatives at any time.
    """

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
    """Largest speed, acceleration and jerk of each driven joint, as proven bounds."""
    versions: Mapping[str, str]
    """What the numbers depend on besides arm and job: armtempo, numpy, scipy, Python, processor."""

    @property
    def total_s(self) -> float:
        """The motion time: when the last joint arrives, seconds."""
        return self.trajectory.duration_s

    def save(self, path: Path | str, force: bool = False) -> None:
        """Write the trajectory file, whole or not at all.

        ``force``: also over a file that is no earlier plan of the same job for the same arm, by their names.
        Raises InputError where such a file is there, or the file cannot be written.
        """
        from armtempo.model import trajectory_file

        trajectory_file.save(self, path, force)

    def to_csv(self, rate_hz: float = 100.0) -> str:
        """Angle, speed, acceleration and jerk of each driven joint as CSV, ``rate_hz`` lines a second."""
        from armtempo.model import exchange

        return exchange.to_csv(self, rate_hz)

    def to_ros(self, rate_hz: float = 100.0, frame_id: str = "") -> str:
        """A trajectory_msgs/JointTrajectory message in YAML, radians, with ``rate_hz`` points a second."""
        from armtempo.model import exchange

        return exchange.to_ros(self, rate_hz, frame_id)

    @classmethod
    def load(cls, path: Path | str, altered: bool = False) -> Plan:
        """The plan of a trajectory file; ``altered``: also of one that was altered after it had been written.

        InputError where the file is none, is damaged, altered or does not fit.
        """
        from armtempo.model import trajectory_file

        return trajectory_file.load(path, altered)
