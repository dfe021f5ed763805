"""The kinematics of an arm in degrees and millimetres: what the library offers of this package."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from armtempo.basics.arguments import checked
from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.kinematics.chain import spread_deg
from armtempo.kinematics.choice import Candidate, choose
from armtempo.kinematics.constraint import Miss
from armtempo.kinematics.forward import forward as forward_rad
from armtempo.kinematics.geometry import Geometry
from armtempo.kinematics.numerical import NumericalSolution
from armtempo.kinematics.solver import Answer, PoseSolver
from armtempo.model.arm import Arm
from armtempo.model.pose import checked as checked_pose
from armtempo.model.tool_pose import WHOLE, Pose

_FAR_DEG, _FAR = 5.0, 50.0
"""No tolerance brings a joint back that is outside its range by more than that, or by this many times the tolerance."""


@dataclass(frozen=True, eq=False)
class Solution:
    """Joint angles that bring the tool to a pose."""

    angles_deg: Array
    """(joints,): of all joints of the arm; NaN if the pose is out of reach of this branch."""
    branch: str
    """Which of the arm's configurations it is; empty for one that was found numerically."""
    rejections: tuple[str, ...]
    """Why it cannot be used: out of reach, out of a joint's range; empty for one that can."""
    distance_deg: float
    """From the posture to stay near to: root of the sum of squares over the joints."""
    miss_mm: float
    """How far the tool then is from the pose, within its tolerance; 0 with the closed form."""
    miss_deg: float
    """The same for what the pose asks of the orientation."""

    @property
    def usable(self) -> bool:
        """Whether the arm can take these angles."""
        return not self.rejections


@checked
def forward(arm: Arm | Path | str, angles_deg: ArrayLike) -> Array:
    """The tool's pose, Eq. (1): (..., 4, 4), lengths in mm, in the frame of the base.

    ``arm``: or its file or name. ``angles_deg``: of all joints, (..., joints), or of the driven ones, (..., J), with
    the others at their home angles. Raises InputError for another number of angles.
    """
    arm = Arm.shape(arm)
    return forward_rad(Geometry.of(arm), np.radians(spread_deg(arm, angles_deg)))


@checked
def inverse(
    arm: Arm | Path | str, pose: Pose | ArrayLike, near_deg: ArrayLike | None = None
) -> tuple[Solution, ...]:
    """All solutions for a pose of the tool: those that can be used first, the nearest to ``near_deg`` first.

    ``pose``: (4, 4) or (3, 4), lengths in mm, or a Pose, which may ask for less than the whole orientation.
    ``near_deg``, (joints,) or (J,), is the posture to stay near to; None: home. A whole pose of an arm of the
    closed form's class has eight solutions, some perhaps rejected. Any other arm or pose gets what a numerical
    search finds with the joints that have a motor, perhaps nothing: of a pose that asks for fewer numbers than joints
    move the one that the search comes to first, else all, but at most 16 where one turns into the next, as at a
    singular pose. Raises InputError for a matrix that is not a pose.
    """
    solver = PoseSolver(Arm.shape(arm))
    near = solver.home_rad if near_deg is None else tuple(_posture(solver.arm, near_deg).tolist())
    target = pose.exact() if isinstance(pose, Pose) else Pose.of_matrix(checked_pose(pose))
    solutions = _exact(solver, target, near) or _solutions(solver.solve(target, near))
    return tuple(
        sorted(solutions, key=lambda one: (not one.usable, math.isnan(one.distance_deg), one.distance_deg))
    )


def _exact(solver: PoseSolver, target: Pose, near: tuple[float, ...]) -> list[Solution]:
    """The eight of the closed form; empty if it does not serve, or a posture within the tolerance may be usable."""
    if target.fixed != WHOLE or solver.refusals:
        return []
    choice = choose(solver.geometry, target.matrix, solver.ranges, near)
    turn = math.radians(target.tolerance_deg)
    slack_mm, slack_deg = (
        target.tolerance_mm + turn * solver.geometry.reach,
        max(_FAR_DEG, _FAR * target.tolerance_deg),
    )
    for each in choice.candidates:
        slack = [slack_mm if reason.kind == "unreachable" else slack_deg for reason in each.rejections]
        small = all(abs(reason.amount) < most for reason, most in zip(each.rejections, slack, strict=True))
        if each.rejections and small and not choice.chosen:
            return []
    return [_solution(each, str(each.branch), Miss(0.0, 0.0)) for each in choice.candidates]


def _posture(arm: Arm, near_deg: ArrayLike) -> Array:
    """All joints, (joints,), in rad."""
    near = np.asarray(near_deg, dtype=float)
    if near.ndim != 1:
        raise InputError("near_deg must be one posture", "give an angle for each joint")
    return np.radians(spread_deg(arm, near, "near_deg: "))


def _solutions(answer: Answer) -> list[Solution]:
    """Those of the search where it found one that can be used, else the eight of the closed form."""
    if answer.choice and not answer.success:
        return [_solution(each, str(each.branch), Miss(0.0, 0.0)) for each in answer.choice.candidates]
    return [_solution(each, "", each.miss) for each in answer.search.solutions] if answer.search else []


def _solution(found: Candidate | NumericalSolution, branch: str, miss: Miss) -> Solution:
    return Solution(
        np.degrees(found.angles_rad),
        branch,
        tuple(reason.text for reason in found.rejections),
        float(np.degrees(found.distance_rad)),
        miss.position_mm,
        miss.rotation_deg,
    )
