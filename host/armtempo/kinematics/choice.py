"""The automatic choice: of the eight solutions the one nearest to the previous posture, within the ranges."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from armtempo.basics.arrays import Array
from armtempo.kinematics.branches import BRANCHES, Branch
from armtempo.kinematics.folding import folded
from armtempo.kinematics.geometry import Geometry
from armtempo.kinematics.inverse import inverse_of_pose, wrist_centre
from armtempo.kinematics.ranges import Ranges
from armtempo.kinematics.regions import Regions, classify
from armtempo.kinematics.rejection import Rejection, WristCentre, reasons
from armtempo.kinematics.shape import Shape


@dataclass(frozen=True)
class Candidate:
    """One of the eight solutions of a pose."""

    number: int
    """1 to 8."""
    branch: Branch
    angles_rad: Array
    """(joints,): whole turns added to lie in the ranges, nearest to the previous posture; NaN if unreachable."""
    rejections: tuple[Rejection, ...]
    """Why not; empty for a solution that can be used."""
    singular: int
    """Bits as in ``Solutions.singular``."""
    distance_rad: float
    """Root of the sum of squares of the joints' ways from the previous posture."""


@dataclass(frozen=True, eq=False)
class Choice:
    """All solutions of a pose and the one chosen."""

    candidates: tuple[Candidate, ...]
    wrist: WristCentre

    @cached_property
    def chosen(self) -> Candidate | None:
        """The nearest that can be used; None: none can."""
        usable = [candidate for candidate in self.candidates if not candidate.rejections]
        return min(usable, key=lambda candidate: candidate.distance_rad, default=None)

    @cached_property
    def _region(self) -> Regions:
        return classify(self.wrist.shape, self.wrist.position)

    @property
    def region(self) -> str:
        """Of Fig. 3, as in ``Regions.names``."""
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
    shape = Shape.of(geometry)
    matrix = np.asarray(pose, dtype=np.float64)
    previous = np.asarray(previous_rad, dtype=np.float64).tolist()
    solutions = inverse_of_pose(geometry, matrix.ravel().tolist(), previous)
    wrist = WristCentre(shape, wrist_centre(shape, folded(geometry, matrix).reshape(16, 1))[:, 0], unit)
    candidates = []
    for i, branch in enumerate(BRANCHES):
        placed = ranges.placed(solutions.angles_rad[i], previous)
        why = reasons(wrist, solutions, i, ranges, placed)
        distance = math.dist(placed, previous)
        candidates.append(Candidate(i + 1, branch, np.array(placed), why, solutions.singular[i], distance))
    return Choice(tuple(candidates), wrist)
