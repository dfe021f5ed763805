"""The automatic choice, closed forms of folded arms, the placing of angles in ranges, and why others are refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from armtempo.basics.arrays import Array
from armtempo.kinematics import (
    BRANCHES,
    Branch,
    Geometry,
    PoseSolver,
    Ranges,
    branch_of,
    choose,
    forward,
    inverse,
    inverse_of_pose,
    refusals,
)
from armtempo.kinematics.choice import Choice
from armtempo.kinematics.of_arm import inverse as inverse_of_arm
from armtempo.kinematics.solutions import OK
from armtempo.kinematics.solver import CLOSED_FORM
from armtempo.model.arm import Arm
from armtempo.model.parts import Joint
from armtempo.model.tool_pose import Pose
from armtempo.new_arm.urdf_rows import AxisLine, Near, derive, rounded
from armtempo.new_arm.urdf_rows import geometry as geometry_of

from tests.host.arms import NAMED, PAPER, PUBLISHED, SHAPE, with_wrist_at

ARM = Arm.paper()
RANGES = Ranges.of(ARM)
ANY = Ranges(np.full(6, -2 * np.pi), np.full(6, 2 * np.pi))
HOME = np.radians([joint.home_deg for joint in ARM.joints])
ROWS = {
    "pedestal": Joint("base", 120.0, 35.0, 90.0, 30.0, (-0.001, 0.001)),
    "tool": Joint("tool", 60.0, -15.0, 40.0, -75.0, (-0.001, 0.001)),
}
AXES = {
    "IRB 140": ("z 0 0 0", "y 70 0 352", "y 70 0 712", "x 70 0 712", "y 450 0 712", "x 450 0 712", "x 515 0 712"),
    "KR 16": ("-z 0 0 0", "y 260 0 675", "y 940 0 675", "-x 940 0 640", "y 1610 0 640", "-x 940 0 640", "x 1768 0 640"),
    "Niryo One": ("z 0 0 103", "-y 0 0 183", "-y 0 0 393", "x 37 0 425", "-y 217 0 425", "x 235 0 425", "x 235 0 425"),
}  # fmt: skip
"""Axes of robot descriptions at angles 0, with a point of each in mm; the last one is the tool's."""


def ranges_deg(*ends: tuple[float, float]) -> Ranges:
    low, high = np.radians(ends).T
    return Ranges(low, high)


@pytest.mark.parametrize(
    ("angle", "previous", "ends", "placed"),
    [
        (170.0, -170.0, (-180.0, 180.0), 170.0),  # the near turn, -190, is out of range
        (170.0, -170.0, (-200.0, 200.0), -190.0),
        (170.0, -170.0, (-180.0, 600.0), 170.0),
        (10.0, 700.0, (-360.0, 720.0), 370.0 + 360.0 - 360.0),
        (10.0, 700.0, (-360.0, 730.0), 730.0),
        (-170.0, 0.0, (100.0, 200.0), 190.0),
        (90.0, 0.0, (-30.0, 30.0), 90.0),  # does not fit: nearest to the range
        (350.0, 0.0, (-180.0, 180.0), -10.0),
        (200.0, 0.0, (-90.0, 90.0), -160.0),
        (5.0, 0.0, (5.0 + 1e-9, 10.0), 5.0 + 1e-9),  # rounding is put right
    ],
)
def test_whole_turns_bring_an_angle_into_range_nearest_to_the_previous(
    angle: float, previous: float, ends: tuple[float, float], placed: float
) -> None:
    (found,) = ranges_deg(ends).placed(np.radians([angle]).tolist(), np.radians([previous]).tolist())
    assert np.degrees(found) == pytest.approx(placed, abs=1e-10)


def test_excess_says_how_far_and_on_which_side() -> None:
    ranges = ranges_deg((-10.0, 20.0), (-10.0, 20.0), (-10.0, 20.0))
    found = np.degrees(ranges.excess(np.radians([-12.0, 5.0, 25.0]).tolist()))
    np.testing.assert_allclose(found, [-2.0, 0.0, 5.0], atol=1e-12)


def test_the_chosen_solution_is_the_nearest_that_can_be_used() -> None:
    rng = np.random.default_rng(12)
    for name, (geometry, ranges) in PUBLISHED.items():
        for _ in range(40):
            angles = rng.uniform(ranges.low, ranges.high)
            previous = rng.uniform(ranges.low, ranges.high)
            choice = choose(geometry, forward(geometry, angles), ranges, previous, "m")
            assert choice.chosen is not None, name
            chosen = choice.chosen.angles_rad
            assert (chosen >= ranges.low).all()
            assert (chosen <= ranges.high).all()
            np.testing.assert_allclose(
                forward(geometry, chosen), forward(geometry, angles), atol=1e-9 * geometry.reach
            )
            way = np.linalg.norm(chosen - previous)
            assert way == pytest.approx(choice.chosen.distance_rad)
            assert way <= np.linalg.norm(angles - previous) + 1e-9
            for candidate in choice.candidates:
                assert bool(candidate.rejections) or candidate.distance_rad >= way - 1e-12


def test_staying_where_the_arm_stands_costs_nothing() -> None:
    rng = np.random.default_rng(13)
    for geometry in NAMED.values():
        angles = rng.uniform(-np.pi, np.pi, 6)
        choice = choose(geometry, forward(geometry, angles), ANY, angles)
        assert choice.chosen is not None
        np.testing.assert_allclose(choice.chosen.angles_rad, angles, atol=1e-7)


def test_paper_s_last_via_point_is_chosen_from_table_2() -> None:
    pose = forward(PAPER, np.radians([180.0, -38.0, -52.0, 0.0, 0.0, 0.0]))
    choice = choose(PAPER, pose, RANGES, np.radians([160.0, -45.0, -20.0, 0.0, 0.0, 0.0]))
    assert (choice.region, choice.postures, choice.on_axis) == ("II", 4, False)
    assert choice.chosen is not None
    assert choice.chosen.number == 1
    np.testing.assert_allclose(np.degrees(choice.chosen.angles_rad), [180, -38, -52, 0, 0, 0], atol=1e-9)
    rejected = [candidate for candidate in choice.candidates if candidate.rejections]
    assert [candidate.number for candidate in rejected] == [7, 8]
    reason = rejected[0].rejections[0]
    assert (reason.kind, reason.joint) == ("range", 2)
    # 168.3 degrees of Table 2 or a turn less, -191.7: the latter misses the range -170 to 10 by less.
    assert reason.amount == pytest.approx(-21.662, abs=1e-3)
    assert reason.text == "joint 2 at -191.7 deg is 21.66 deg below its range -170 to 10"


def test_every_joint_out_of_range_is_named() -> None:
    angles = np.radians([30.0, -60.0, 40.0, 20.0, 50.0, 60.0])
    narrow = ranges_deg((-10, 10), (-90, 0), (-90, 90), (40, 50), (-90, 90), (-90, 55))
    choice = choose(PAPER, forward(PAPER, angles), narrow, np.zeros(6))
    assert choice.chosen is None
    reasons = choice.candidates[0].rejections
    assert [reason.joint for reason in reasons] == [1, 4, 6]
    np.testing.assert_allclose([reason.amount for reason in reasons], [20.0, -20.0, 5.0], atol=1e-9)


def unreachable(choice: Choice, number: int) -> tuple[float, int | None]:
    (reason,) = choice.candidates[number - 1].rejections
    assert reason.kind == "unreachable"
    assert f"by {reason.amount:.6g} mm" in reason.text
    return reason.amount, reason.inequality


@pytest.mark.parametrize(
    ("planar", "up", "number", "amount", "line"),
    [
        (SHAPE.farthest + 150.0, 0.0, 1, 250.0, 1),  # the front shoulder is 100 behind axis 1
        (SHAPE.farthest + 150.0, 0.0, 5, 50.0, 1),
        (100.0, -SHAPE.farthest - 30.0, 5, 30.0, 2),
        (100.0, SHAPE.farthest + 30.0, 5, 30.0, 3),
        (100.0, 5.0, 5, SHAPE.nearest - 5.0, 4),
    ],
)
def test_unreachable_names_the_line_of_eq_3(
    planar: float, up: float, number: int, amount: float, line: int
) -> None:
    choice = choose(PAPER, with_wrist_at(planar, up), RANGES, HOME)
    assert unreachable(choice, number) == (pytest.approx(amount, rel=1e-9), line)
    assert f"(Eq. (3), line {line})" in choice.candidates[number - 1].rejections[0].text


def test_unreachable_within_the_shoulder_offset() -> None:
    pose = np.eye(4)
    pose[:3, 3] = 0.1, 0.0, 0.9
    choice = choose(NAMED["puma_560"], pose, ANY, np.zeros(6), "m")
    (reason,) = choice.candidates[0].rejections
    assert reason.amount == pytest.approx(0.05005)
    assert "by 0.05005 m: wrist centre 0.1 m from axis 1" in reason.text


def test_duplicates_name_their_twin() -> None:
    choice = choose(PAPER, with_wrist_at(SHAPE.farthest - 100.0, 0.0), ANY, HOME)
    assert [candidate.rejections[0].twin for candidate in choice.candidates[2:4]] == [1, 2]
    puma = NAMED["puma_560"]
    pose = np.eye(4)
    pose[:3, 3] = puma.d[2], 0.0, 0.9
    choice = choose(puma, pose, ANY, np.zeros(6), "m")
    for candidate in choice.candidates[4:]:
        (reason,) = candidate.rejections
        assert reason.kind == "duplicate"
        assert reason.twin is not None
        twin = choice.candidates[reason.twin - 1]
        np.testing.assert_allclose(
            np.exp(1j * twin.angles_rad), np.exp(1j * candidate.angles_rad), atol=1e-12
        )


def test_branch_of_an_arm_between_two_branches_is_left_open() -> None:
    straight = branch_of(PAPER, np.radians([0.0, -60.0, 40.0, 0.0, 0.0, 0.0]))
    assert straight == Branch("front", "up", "")
    assert str(straight) == "front up"
    assert straight.differs(BRANCHES[0]) == ()
    assert BRANCHES[0].differs(BRANCHES[7]) == ("base", "elbow", "wrist")


def test_branches_do_not_depend_on_the_sign_of_a2() -> None:
    flipped = replace(
        PAPER, a=(PAPER.a[0], -PAPER.a[1], *PAPER.a[2:]), offset=(0.0, np.pi, np.pi, 0.0, 0.0, 0.0)
    )
    assert isinstance(flipped, Geometry)
    rng = np.random.default_rng(14)
    for angles in rng.uniform(-np.pi, np.pi, (20, 6)):
        np.testing.assert_allclose(forward(flipped, angles), forward(PAPER, angles), atol=1e-9)
        assert branch_of(flipped, angles) == branch_of(PAPER, angles)


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
