"""The automatic choice: of the eight solutions the one nearest to the previous posture, within the ranges."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from armtempo.basics.arrays import Array
from armtempo.kinematics.closed_form import Regions, classify
from armtempo.kinematics.formulas import wrist_centre
from armtempo.kinematics.geometry import Geometry
from armtempo.kinematics.inverse import folded, inverse_of_pose, spread
from armtempo.kinematics.ranges import Ranges
from armtempo.kinematics.rejection import Rejection, WristCentre, reasons
from armtempo.kinematics.shape import Shape
from armtempo.kinematics.solutions import BRANCHES, OK, OUT_OF_REACH, Branch, PoseSolutions

_SAME_RAD = 0.1
"""Postures nearer than this, in joint space, lead to the same one."""


@dataclass(eq=False, slots=True)
class Candidate:
    """One of the eight solutions of a pose."""

    of: Choice = field(repr=False)
    index: int
    placed_rad: list[float]
    """(joints,): whole turns added to lie in the ranges, nearest to the previous posture; NaN if unreachable."""
    usable: bool
    """Whether the arm can take these angles."""
    distance_rad: float
    """Euclidean distance from the previous posture in joint space."""
    outside_rad: float
    """Largest excess of a joint over its range; inf if unreachable."""

    @property
    def number(self) -> int:
        """1 to 8."""
        return self.index + 1

    @property
    def branch(self) -> Branch:
        """Its branch."""
        return BRANCHES[self.index]

    @property
    def angles_rad(self) -> Array:
        """``placed_rad`` as an array."""
        return np.array(self.placed_rad)

    @property
    def rejections(self) -> tuple[Rejection, ...]:
        """The reasons for rejection; empty for a usable solution."""
        if self.usable:
            return ()
        return reasons(self.of.wrist, self.of.solutions, self.index, self.of.ranges, self.placed_rad)

    @property
    def singular(self) -> int:
        """Bits as in ``Solutions.singular``."""
        return self.of.solutions.singular[self.index]


@dataclass(eq=False)
class Choice:
    """All solutions of a pose and the chosen one; texts are only made on request."""

    geometry: Geometry
    pose: Sequence[float]
    """Its 12 or 16 elements in row order."""
    ranges: Ranges
    unit: str
    """Of lengths, for the reasons."""
    solutions: PoseSolutions
    candidates: list[Candidate] = field(default_factory=list)

    @cached_property
    def chosen(self) -> Candidate | None:
        """The nearest usable solution; None if there is none."""
        usable = [candidate for candidate in self.candidates if candidate.usable]
        return min(usable, key=lambda candidate: candidate.distance_rad, default=None)

    @cached_property
    def shape(self) -> Shape:
        """Constants of the closed form."""
        return Shape.of(self.geometry)

    @cached_property
    def _of_core(self) -> Sequence[float]:
        """The pose for the rows that turn, in row order."""
        if self.geometry.moving is self.geometry:
            return self.pose
        pose = np.append(self.pose[:12], (0.0, 0.0, 0.0, 1.0)).reshape(4, 4)
        rows: list[float] = folded(self.geometry, pose).ravel().tolist()
        return rows

    @cached_property
    def wrist(self) -> WristCentre:
        """The wrist centre of the pose."""
        rows = self._of_core
        x, y, z = (wrist_centre(self.shape, *rows[start : start + 4]) for start in (0, 4, 8))
        return WristCentre(self.shape, (x, y, z), self.unit)

    @property
    def beyond(self) -> float:
        """Least excess of a branch over its reach; inf if no branch is out of reach."""
        if not any(math.isinf(each.outside_rad) for each in self.candidates):
            return math.inf
        return self.wrist.beyond

    def may_fit(self, each: Candidate, moved: float, turned_rad: float) -> bool:
        """Whether the ranges may hold ``each`` for a wrist centre moved, and a tool turned, by at most this.

        To first order, and quick: mostly it tells where not.
        """
        arm = self.wrist.swing_rad(each.index, moved)
        start = self.geometry.core.start
        excess = [abs(excess) for excess in self.ranges.excess(each.placed_rad)[start : start + 6]]
        sin5 = math.sin(each.placed_rad[start + 4] + self.shape.joint_offset[4])
        return max(excess[:3]) <= arm and max(excess[3:]) * abs(sin5) <= turned_rad + arm

    def of_nearer_poses(self, previous: Sequence[float], by: float, slack_rad: float) -> list[list[float]]:
        """Postures, (joints,) each, for the tool moved slightly outwards or inwards, for a pose on a border.

        No joint is out of its range by more than ``slack_rad``; of near ones one.
        """
        x, y, z = self.wrist.position
        z -= self.shape.height
        found: list[list[float]] = []
        for way in np.array(((x, y, z), (-x, -y, -z), (x, y, 0.0))):
            pose = np.array(self._of_core[:12]).reshape(3, 4)
            pose[:, 3] += 2.0 * by * way / (np.linalg.norm(way) or 1.0)
            core = [*previous][self.geometry.core]
            solved = inverse_of_pose(self.geometry.moving, pose.ravel().tolist(), core)
            for angles, outcome in zip(*solved[:2], strict=True):
                if outcome == OK:
                    placed, outside = self.ranges.fitted(spread(self.geometry, angles), previous)
                    if outside <= slack_rad and all(math.dist(placed, each) > _SAME_RAD for each in found):
                        found.append(placed)
        return found

    @cached_property
    def _region(self) -> Regions:
        return classify(self.shape, self.wrist.position)

    @property
    def region(self) -> str:
        """Region of Fig. 3, as in ``Regions.names``."""
        return self._region.names[0]

    @property
    def postures(self) -> int:
        """Arm postures in that region, 0 to 4."""
        return int(self._region.postures[0])

    @property
    def on_axis(self) -> bool:
        """Wrist centre on axis 1: joint 1 is kept as in the previous posture."""
        return bool(self._region.axis[0])


def choose(
    geometry: Geometry, pose: ArrayLike, ranges: Ranges, previous_rad: ArrayLike, unit: str = "mm"
) -> Choice:
    """Solve one pose, shape (4, 4), and choose; ``previous_rad`` has shape (joints,).

    ``unit`` names the geometry's unit of length in the reasons. Raises InputError for an arm outside the
    class.
    """
    rows = np.asarray(pose, dtype=np.float64).ravel().tolist()
    previous = np.asarray(previous_rad, dtype=np.float64).tolist()
    return choose_of_rows(geometry, rows, ranges, previous, unit)


def choose_of_rows(
    geometry: Geometry, pose: Sequence[float], ranges: Ranges, previous: Sequence[float], unit: str = "mm"
) -> Choice:
    """As ``choose``, for the pose's 12 or 16 elements in row order, with plain numbers."""
    solutions = inverse_of_pose(geometry, pose, previous)
    choice = Choice(geometry, pose, ranges, unit, solutions)
    for index, (angles, outcome) in enumerate(zip(solutions.angles_rad, solutions.outcome, strict=True)):
        if outcome in OUT_OF_REACH:
            choice.candidates.append(Candidate(choice, index, [*angles], False, math.nan, math.inf))
            continue
        placed, outside = ranges.fitted(angles, previous)
        usable = outcome == OK and not outside
        choice.candidates.append(
            Candidate(choice, index, placed, usable, math.dist(placed, previous), outside)
        )
    return choice
