"""A plan: the trajectory with arm, job and search results, and its file.

The trajectory file is JSON, with everything that is needed to run the plan and to plan it again. It has a
sha256 of the plan, independent of white space; files of version 1 have none.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from armtempo_shared.basis import BASIS

from armtempo.basics import json_codec
from armtempo.basics.arguments import checked
from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.model import arm_json, exchange
from armtempo.model.arm import Arm
from armtempo.model.job import AUTO, Job
from armtempo.model.plan_file import PlanFile
from armtempo.splines.extremes import Extremes
from armtempo.splines.trajectory import JointSpline, Trajectory

FILE = PlanFile(
    "armtempo trajectory",
    "plan",
    "a trajectory file",
    "armtempo plan",
    "a trajectory file is replaced by one of the same job, by its name, for an arm of the same name",
    (1, 2),
)


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


@checked
@dataclass(frozen=True, eq=False, repr=False)
class Plan:
    """A motion of ``arm`` for ``job`` within all limits.

    ``trajectory(time_s, order)``: angles of the driven joints or their derivatives, (..., J).
    """

    arm: Arm
    job: Job
    via_deg: Array
    """Angles of the driven joints at the via points, (n + 1, J)."""
    notes: tuple[str, ...]
    """Notes for the user about the solution of poses."""
    trajectory: Trajectory
    searches: tuple[Search, ...]
    """One for each joint that moves, or one for the shared time axis."""
    extremes: tuple[Extremes, ...]
    """Largest speed, acceleration and jerk of each driven joint, as proven bounds."""
    versions: Mapping[str, str]
    """Versions on which the numbers depend: armtempo, numpy, scipy, Python, processor."""
    is_sequence: ClassVar[Literal[False]] = False

    def __repr__(self) -> str:
        return f"<Plan {self.job.name!r} for {self.arm.name!r}: {len(self.via_deg)} via points, {self.total_s:.3f} s>"

    @property
    def name(self) -> str:
        """The job's name."""
        return self.job.name

    @property
    def frames(self) -> tuple[str, ...]:
        """Names of the frames that the job's poses are in."""
        return self.job.frames

    @property
    def start_deg(self) -> Array:
        """Start posture, degrees (J,)."""
        return self.trajectory(0.0)

    @property
    def loads(self) -> tuple[str, ...]:
        """What the tool holds in its motion; "": nothing."""
        return (self.job.holds,)

    @property
    def pallets(self) -> tuple[str, ...]:
        """None: those of the arm that a sequence uses."""
        return ()

    @property
    def holding(self) -> Arm:
        """The arm with what it holds in this motion."""
        return self.arm.holding(self.job.holds)

    @property
    def loaded_legs(self) -> list[tuple[Arm, Trajectory]]:
        """Its one leg, with the arm as it is there."""
        return [(self.holding, self.trajectory)]

    @property
    def total_s(self) -> float:
        """The motion time, until the last joint arrives, seconds."""
        return self.trajectory.duration_s

    def save(self, path: Path | str, force: bool = False) -> None:
        """Write the trajectory file, atomically.

        Replaces only a file of the same job for the same arm (by name) that was not altered; ``force``: any
        file. Raises InputError if it may not be replaced, or cannot be written.
        """
        FILE.save(path, self, force, self._is_same)

    def check_replaceable(self, path: Path | str, force: bool = False) -> None:
        """Raise InputError if ``save`` would not replace a file that exists; nothing is written."""
        FILE.check_replaceable(path, self, force, self._is_same)

    def _is_same(self, content: Any) -> bool:
        """Whether the content of a file is a plan of the same job and arm, by their names."""
        return (content["job"]["name"], content["arm"]["name"]) == (self.name, self.arm.name)

    def to_csv(self, rate_hz: float = 100.0) -> str:
        """Angle, speed, acceleration and jerk of each driven joint as CSV, ``rate_hz`` lines a second."""
        return exchange.to_csv(self.trajectory, [joint.unit for joint in self.arm.driven], rate_hz)

    def to_ros(self, rate_hz: float = 100.0, frame_id: str = "") -> str:
        """A trajectory_msgs/JointTrajectory message in YAML, radians and metres, with ``rate_hz`` points a second."""
        driven = self.arm.driven
        names, units = [joint.name for joint in driven], [joint.unit for joint in driven]
        return exchange.to_ros(self.trajectory, names, units, rate_hz, frame_id)

    @classmethod
    def load(cls, path: Path | str, altered: bool = False) -> Plan:
        """The plan of a trajectory file.

        ``altered``: accept a file that was altered after it had been written. Raises InputError for a file
        that is missing, incomplete, altered, of another format or version, or has an unknown key, value or
        shape.
        """
        plan: Plan = json_codec.decode(cls, FILE.read(path, altered), f"{path}: plan")
        _check(plan, path)
        return plan


def _check(plan: Plan, path: Path | str) -> None:
    """Check what types cannot express: shapes, increasing times, one spline for each driven joint."""
    arm_json.check(plan.arm, f"{path}: arm", "plan it again")
    joints, driven = plan.trajectory.joints, plan.arm.driven
    if not joints or len(joints) != len(driven):
        raise InputError(
            f"{path}: {len(joints)} joints in the trajectory, the arm drives {len(driven)}",
            "plan it again",
        )
    if plan.via_deg.shape[1:] != (len(driven),) or len(plan.extremes) != len(driven):
        raise InputError(
            f"{path}: via_deg and extremes must have an entry for each of {len(driven)} joints",
            "plan it again",
        )
    for number, spline in enumerate(joints, 1):
        _check_spline(spline, len(plan.via_deg) - 1, f"{path}: trajectory joint {number}")
    if plan.trajectory.shared and any(
        not np.array_equal(spline.time_points_s, joints[0].time_points_s) for spline in joints
    ):
        raise InputError(
            f"{path}: shared timing, but the joints' time control points differ",
            "plan it again",
        )
    if isinstance(plan.job.refine, str) and plan.job.refine != AUTO:
        raise InputError(
            f"{path}: plan.job.refine {plan.job.refine!r} should be a number or {AUTO!r}", "plan it again"
        )
    if any(not 0 <= index < len(joints) for search in plan.searches for index in search.joints):
        raise InputError(f"{path}: searches name a joint that does not exist", "plan it again")


def _check_spline(spline: JointSpline, legs: int, where: str) -> None:
    segments = legs
    if spline.via_segments is not None:
        if len(spline.via_segments) != legs + 1 or spline.via_segments[0] != 0:
            raise InputError(
                f"{where}: via_segments must name {legs + 1} via points, the first at 0", "plan it again"
            )
        if np.any(np.diff(spline.via_segments) < 1):
            raise InputError(f"{where}: its via_segments do not increase", "plan it again")
        segments = spline.via_segments[-1]
    if spline.degree not in BASIS or spline.refine < 1:
        raise InputError(
            f"{where}: degree {spline.degree} with refine {spline.refine} is not known",
            "plan it again",
        )
    for what, points, pieces in (
        ("angle", spline.angle_points_deg, segments),
        ("time", spline.time_points_s, segments * spline.refine),
    ):
        if points.shape != (pieces + spline.degree,):
            raise InputError(
                f"{where}: {points.size} {what} control points do not fit {pieces} segments",
                "plan it again",
            )
    if not np.all(np.diff(spline.time_points_s) > 0):
        raise InputError(f"{where}: its time control points do not increase", "plan it again")
