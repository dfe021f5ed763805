"""The kinematics of an arm in degrees and millimetres: what the library offers of this package."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from armtempo.arrays import Array
from armtempo.errors import InputError
from armtempo.kinematics import numerical
from armtempo.kinematics.chain import all_angles_deg
from armtempo.kinematics.choice import choose
from armtempo.kinematics.forward import forward as forward_rad
from armtempo.kinematics.geometry import Geometry
from armtempo.kinematics.ranges import Ranges
from armtempo.kinematics.shape import refusals
from armtempo.model.arm import Arm
from armtempo.model.job import Pose
from armtempo.model.pose import checked


@dataclass(frozen=True, eq=False)
class Solution:
    """Joint angles that bring the tool to a pose."""

    angles_deg: Array
    """(joints,): of all joints of the arm; NaN where the pose is out of reach of this branch."""
    branch: str
    """Which of the arm's configurations it is; empty for one that was found numerically."""
    rejections: tuple[str, ...]
    """Why it cannot be used: out of reach, out of a joint's range; empty for one that can."""
    distance_deg: float
    """From the posture to stay near to: root of the sum of squares over the joints."""

    @property
    def usable(self) -> bool:
        """Whether the arm can take these angles."""
        return not self.rejections


def forward(arm: Arm, angles_deg: ArrayLike) -> Array:
    """The tool's pose, Eq. (1): (..., 4, 4), lengths in mm, in the frame of the base.

    ``angles_deg``: of all joints, (..., joints), or of the driven ones, (..., J), with the others at home.
    Raises InputError for another number of angles.
    """
    angles = np.asarray(angles_deg, dtype=float)
    count = angles.shape[-1] if angles.ndim else 0
    if count not in (len(arm.joints), len(arm.driven)):
        raise InputError(
            f"{count} angles; arm {arm.name!r} has {len(arm.joints)} joints, {len(arm.driven)} of them driven"
        )
    if count != len(arm.joints):
        angles = all_angles_deg(arm, angles)
    return forward_rad(Geometry.of(arm), np.radians(angles))


def inverse(arm: Arm, pose: Pose | ArrayLike, near_deg: ArrayLike | None = None) -> tuple[Solution, ...]:
    """All solutions for a pose of the tool: those that can be used first, the nearest to ``near_deg`` first.

    ``pose``: (4, 4) or (3, 4), lengths in mm, or a Pose. ``near_deg``, (joints,), is the posture to stay near to;
    None: home. An arm of the class of the closed form has eight solutions, some perhaps rejected; any other gets
    the one that a numerical search finds, or none. Raises InputError for a matrix that is no pose.
    """
    target = checked(pose.matrix if isinstance(pose, Pose) else np.asarray(pose, dtype=float))
    near = [joint.home_deg for joint in arm.joints] if near_deg is None else near_deg
    previous = np.radians(np.asarray(near, dtype=float))
    if previous.shape != (len(arm.joints),):
        raise InputError(f"near_deg must have an angle for each of the {len(arm.joints)} joints")
    geometry, ranges = Geometry.of(arm), Ranges.of(arm)
    if refusals(geometry):
        found = numerical.solve(geometry, target, ranges, previous)
        distance = float(np.linalg.norm(np.degrees(found.angles_rad - previous)))
        return (Solution(np.degrees(found.angles_rad), "", (), distance),) if found.found else ()
    choice = choose(geometry, target, ranges, previous)
    solutions = (
        Solution(
            np.degrees(candidate.angles_rad),
            str(candidate.branch),
            tuple(reason.text for reason in candidate.rejections),
            float(np.degrees(candidate.distance_rad)),
        )
        for candidate in choice.candidates
    )
    return tuple(
        sorted(solutions, key=lambda one: (not one.usable, np.nan_to_num(one.distance_deg, nan=np.inf)))
    )
