"""The postures of an arm with the tool at another position."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.errors import PlanError
from armtempo.kinematics.chain import all_angles_deg
from armtempo.kinematics.forward import forward
from armtempo.kinematics.geometry import Geometry
from armtempo.kinematics.solver import PoseSolver
from armtempo.model.arm import Arm
from armtempo.model.tool_pose import CONSTRAINTS, WHOLE, Pose

_SAME_DEG = 0.01


def moved_tool_deg(arm: Arm, angles_deg: Array, position_mm: Sequence[float]) -> list[Array]:
    """The postures of the driven joints, (J,) each, with the tool at ``position_mm``, nearest to ``angles_deg`` first.

    With six driven joints the tool's orientation is kept; with fewer only the position is reached. Raises
    PlanError, with the reason, if there is no such posture.
    """
    solver = PoseSolver(arm)
    before = np.radians(all_angles_deg(arm, np.asarray(angles_deg, dtype=float)))
    pose = forward(Geometry.of(arm), before)
    pose[:3, 3] = position_mm
    fixed = WHOLE if len(arm.driven) >= CONSTRAINTS[WHOLE] else ()
    answer = solver.solve(Pose.of_matrix(pose, fixed), before.tolist())
    if not answer.success:
        raise PlanError(answer.reason.splitlines()[0].split("; ")[0], "choose another place")
    found: list[Array] = []
    for posture in answer.usable_deg:
        driven = np.array(posture)[list(arm.driven_indices)]
        if all(np.abs(driven - other).max() > _SAME_DEG for other in found):
            found.append(driven)
    return found
