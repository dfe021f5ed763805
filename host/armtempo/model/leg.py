"""Parts of a plan: its legs, each a motion from rest to rest, how that of a job was found, and its rows."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from armtempo_shared.basis import BASIS
from armtempo_shared.sequence import MOVE

from armtempo.basics import json_codec
from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.model.job import Job
from armtempo.splines.extremes import Extremes
from armtempo.splines.trajectory import JointSpline, Trajectory

_AGAIN = "plan it again"


@dataclass(frozen=True, eq=False)
class Search:
    """The search for the time axis of one joint, or for the shared one."""

    joints: tuple[int, ...]
    """Indices (among the driven joints) of the joints with this axis."""
    intervals_s: Array
    """The variables: the intervals X (n,), or with refinement all differences of time control points."""
    total_s: float
    """The motion time."""
    searched_s: float
    """The motion time of the search alone, without polish or refinement."""
    evaluations: int
    """Fitness evaluations of the search."""
    history_s: Array
    """Best fitness of the first population and after each iteration, (iterations + 1,); of a gradient search the best
    motion time after each start."""
    optimum_s: float
    """After polish: lower bound of the local optimum with the same number of intervals; else 0."""
    lower_bound_s: float = field(metadata={json_codec.KEY: "floor_s"})
    """Proven lower bound of the motion time over all time laws along this path; for a free path, over all
    paths through the via points."""
    lower_bound_kind: str = field(metadata={json_codec.KEY: "floor_kind"})
    """How the lower bound was found, see ``lower_bounds.LowerBound``."""
    starts_s: Array = field(default_factory=lambda: np.empty(0), metadata=json_codec.ADDED)
    """For a gradient search, the motion time of each start on few segments; else empty."""


@dataclass(frozen=True, eq=False)
class JobSolution:
    """How the motion of a job was found."""

    job: Job
    via_deg: Array
    """Angles of the driven joints at the via points, (n + 1, J)."""
    searches: tuple[Search, ...]
    """One for each joint that moves, or one for the shared time axis."""
    extremes: tuple[Extremes, ...]
    """Largest speed, acceleration and jerk of each driven joint, as proven bounds."""


@dataclass(frozen=True, eq=False)
class PlanLeg:
    """One motion from rest to rest."""

    trajectory: Trajectory
    """Its name is that on the board."""
    load: str = ""
    """What the tool holds; "": nothing."""
    tool: str = ""
    """The tool, "nothing": none; "": that of the plan's arm."""
    solution: JobSolution | None = None
    """None in a sequence, which keeps its motions alone."""


@dataclass(frozen=True)
class SequenceRow:
    """What the board does in a step: a row of the record (``armtempo_shared.sequence``), with a description."""

    op: int
    number: int
    value: int
    amount: int
    step: int
    words: str

    @property
    def numbers(self) -> tuple[int, ...]:
        """As ``armtempo_shared.sequence.pack`` takes them."""
        return self.op, self.number, self.value, self.amount, self.step


def only_row(name: str) -> SequenceRow:
    """The row of a plan of one motion."""
    return SequenceRow(MOVE, 0, 0, 0, 1, f"run {name}")


def check_spline(spline: JointSpline, vias: int, where: str) -> None:
    """Raise InputError for a spline of a file that does not fit that many via points; its message begins ``where``."""
    legs = segments = vias - 1
    if spline.via_segments is not None:
        if len(spline.via_segments) != legs + 1 or spline.via_segments[0] != 0:
            raise InputError(f"{where}: via_segments must name {legs + 1} via points, the first at 0", _AGAIN)
        if np.any(np.diff(spline.via_segments) < 1):
            raise InputError(f"{where}: its via_segments do not increase", _AGAIN)
        segments = spline.via_segments[-1]
    if spline.degree not in BASIS or spline.refine < 1:
        raise InputError(f"{where}: degree {spline.degree} with refine {spline.refine} is not known", _AGAIN)
    for what, points, pieces in (
        ("angle", spline.angle_points_deg, segments),
        ("time", spline.time_points_s, segments * spline.refine),
    ):
        if points.shape != (pieces + spline.degree,):
            raise InputError(
                f"{where}: {points.size} {what} control points do not fit {pieces} segments", _AGAIN
            )
    if not np.all(np.diff(spline.time_points_s) > 0):
        raise InputError(f"{where}: its time control points do not increase", _AGAIN)
