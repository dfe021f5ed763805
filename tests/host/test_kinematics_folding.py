"""Arms on a pedestal or with a tool, rows that never turn, have the closed form of the joints between."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from armtempo.basics.arrays import Array
from armtempo.kinematics import Geometry, PoseSolver, branch_of, forward, inverse, inverse_of_pose, refusals
from armtempo.kinematics.of_arm import inverse as inverse_of_arm
from armtempo.kinematics.solutions import OK
from armtempo.kinematics.solver import CLOSED_FORM
from armtempo.model.arm import Arm
from armtempo.model.parts import Joint
from armtempo.model.tool_pose import Pose
from armtempo.new_arm.urdf_rows import AxisLine, Near, derive, rounded
from armtempo.new_arm.urdf_rows import geometry as geometry_of

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


AXES = {
    "IRB 140": ("z 0 0 0", "y 70 0 352", "y 70 0 712", "x 70 0 712", "y 450 0 712", "x 450 0 712", "x 515 0 712"),
    "KR 16": ("-z 0 0 0", "y 260 0 675", "y 940 0 675", "-x 940 0 640", "y 1610 0 640", "-x 940 0 640", "x 1768 0 640"),
    "Niryo One": ("z 0 0 103", "-y 0 0 183", "-y 0 0 393", "x 37 0 425", "-y 217 0 425", "x 235 0 425", "x 235 0 425"),
}  # fmt: skip
"""Axes of robot descriptions at angles 0, with a point of each in mm; the last one is the tool's."""


@pytest.mark.parametrize("name", AXES)
def test_arms_as_robot_descriptions_have_them_are_answered_in_closed_form(name: str) -> None:
    """On a pedestal that is turned and leans, so the first row is constant."""
    lean = np.eye(4)
    lean[:3, :3] = [[0.6, 0.0, 0.8], [0.0, 1.0, 0.0], [-0.8, 0.0, 0.6]]
    lean[:3, 3] = 100.0, 50.0, 300.0
    lines = []
    for text in AXES[name]:
        axis, *point = text.split()
        direction = np.eye(3)["xyz".index(axis[-1])] * (-1.0 if axis[0] == "-" else 1.0)
        lines.append(AxisLine(lean[:3, :3] @ np.array(point, float) + lean[:3, 3], lean[:3, :3] @ direction))
    tool = lean.copy()
    tool[:3, 3] = lines[-1].point
    rows = rounded(derive(lines[:-1], tool, Near(1e-6, 1e-7)), 6)
    assert rows[0].joint is None
    still = tuple((index, 0.0) for index, row in enumerate(rows) if row.joint is None)
    geometry = replace(geometry_of(rows), still=still)
    assert refusals(geometry) == []
    rng = np.random.default_rng(2)
    angles = np.zeros((20, len(rows)))
    angles[:, geometry.core] = rng.uniform(-3.0, 3.0, (20, 6))
    poses = forward(geometry, angles)
    assert poses[0] == pytest.approx(
        _turned(lines, angles[0, [index for index, row in enumerate(rows) if row.joint is not None]], tool),
        abs=1e-3,
    )
    found = inverse(geometry, poses)
    for rows_found, outcomes, before in zip(found.angles_rad, found.outcome, angles, strict=True):
        there = rows_found[outcomes == OK]
        assert np.abs(np.sin(0.5 * (there - before))).max(axis=1).min() < 1e-6


def _turned(lines: list[AxisLine], angles: Array, tool: Array) -> Array:
    """The tool's pose by turning about the axes one by one, outermost first (Rodrigues' formula)."""
    pose = tool
    for line, angle in reversed(list(zip(lines, angles, strict=False))):
        x, y, z = line.direction
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        turn = np.eye(4)
        turn[:3, :3] += np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
        turn[:3, 3] = line.point - turn[:3, :3] @ line.point
        pose = turn @ pose
    return pose


def test_what_is_far_from_reach_or_range_is_said_without_a_search(monkeypatch: pytest.MonkeyPatch) -> None:
    """A thousand times as fast; near to them a posture within the tolerance is still looked for."""
    arm = Arm.load("ar4")
    outside, barely = forward(
        Geometry.of(arm), np.radians([[20, 10, 75, 15, 40, 30], [20, 10, 52.02, 15, 40, 30]])
    )
    far = outside.copy()
    far[0, 3] += 5000.0
    assert any(one.usable and one.miss_mm for one in inverse_of_arm(arm, barely))
    monkeypatch.setattr(PoseSolver, "solve", None)
    for pose, why in ((outside, "above its range"), (far, "out of reach by")):
        found = inverse_of_arm(arm, pose)
        assert len(found) == 8
        assert not any(one.usable for one in found)
        assert why in " ".join(text for one in found for text in one.rejections)
