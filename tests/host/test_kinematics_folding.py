"""Arms on a pedestal or with a tool, rows that never turn, have the closed form of the joints between."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from armtempo.kinematics import Geometry, PoseSolver, branch_of, forward, inverse, inverse_of_pose, refusals
from armtempo.kinematics.of_arm import inverse as inverse_of_arm
from armtempo.kinematics.solutions import OK
from armtempo.kinematics.solver import CLOSED_FORM
from armtempo.model.arm import Arm
from armtempo.model.parts import Joint
from armtempo.model.tool_pose import Pose

ROWS = {
    "pedestal": Joint("base", 120.0, 35.0, 90.0, 30.0, (-0.001, 0.001)),
    "tool": Joint("tool", 60.0, -15.0, 40.0, -75.0, (-0.001, 0.001)),
}


def mounted(name: str, pedestal: bool, tool: bool) -> Arm:
    arm = Arm.load(name)
    front = (ROWS["pedestal"],) if pedestal else ()
    return replace(arm, joints=(*front, *arm.joints, *((ROWS["tool"],) if tool else ())))


@pytest.mark.parametrize("name", ["ar4", "paper"])
@pytest.mark.parametrize(("pedestal", "tool"), [(True, False), (False, True), (True, True)])
def test_all_solutions_lead_to_the_pose(name: str, pedestal: bool, tool: bool) -> None:
    plain, arm = Arm.load(name), mounted(name, pedestal, tool)
    geometry, rng = Geometry.of(arm), np.random.default_rng(1)
    assert refusals(geometry) == []
    assert refusals(Geometry.of(plain)) == []
    low, high = np.radians([joint.range_deg for joint in arm.joints]).T
    angles = rng.uniform(low, high, (50, len(low)))
    angles[:, [not geometry.core.start <= joint < geometry.core.stop for joint in range(len(low))]] = 0.0
    poses = forward(geometry, angles)
    found = inverse(geometry, poses)
    for pose, rows, outcomes, before in zip(poses, found.angles_rad, found.outcome, angles, strict=True):
        there = rows[outcomes == OK]
        assert forward(geometry, there) == pytest.approx(np.broadcast_to(pose, (len(there), 4, 4)), abs=1e-8)
        assert np.abs(np.sin(0.5 * (there - before))).max(axis=1).min() < 1e-7
        alone = inverse_of_pose(geometry, pose.ravel().tolist())
        assert np.allclose(np.array(alone.angles_rad), rows, atol=1e-9, equal_nan=True)
        assert branch_of(geometry, before) == branch_of(Geometry.of(plain), before[geometry.core])


def test_a_solver_answers_in_closed_form_and_counts_joints_from_the_base() -> None:
    arm = mounted("ar4", True, True)
    solver = PoseSolver(arm)
    angles = np.radians([0.0, 10.0, 20.0, -15.0, 30.0, 40.0, 50.0, 0.0])
    target = Pose.of_matrix(forward(solver.geometry, angles))
    answer = solver.solve(target, solver.home_rad)
    assert answer.success
    assert answer.search is None
    near = solver.nearest(target, angles + 0.01 * np.array([0, 1, 1, 1, 1, 1, 1, 0]))
    assert near.method == CLOSED_FORM
    assert near.angles_rad == pytest.approx(angles, abs=1e-9)
    texts = [text for one in inverse_of_arm(arm, target) for text in one.rejections]
    assert any(
        text.startswith(("joint 2", "joint 3", "joint 4", "joint 5", "joint 6", "joint 7")) for text in texts
    )


def test_a_row_between_the_joints_or_one_that_can_turn_is_no_pedestal() -> None:
    arm = Arm.load("ar4")
    between = replace(arm, joints=(*arm.joints[:3], ROWS["tool"], *arm.joints[3:]))
    free = replace(arm, joints=(replace(ROWS["pedestal"], range_deg=(-90.0, 90.0)), *arm.joints))
    for one in (between, free):
        assert refusals(Geometry.of(one)) == ["it has 7 joints, not 6"]
