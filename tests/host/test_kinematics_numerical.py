"""The numerical inverse: all postures that a seeded search finds, for any arm and target, parallelograms included."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from armtempo.kinematics import Geometry, Ranges, all_frames, forward, inverse
from armtempo.kinematics.constraint import Constraint, Miss
from armtempo.kinematics.forward import array_frames, frames
from armtempo.kinematics.numerical import MovingArm, NumericalSolutions, search
from armtempo.kinematics.shape import refusals
from armtempo.kinematics.solver import PoseSolver
from armtempo.model.arm import Arm
from armtempo.model.tool_pose import WHOLE, Pose

from tests.host.arms import (
    FITTING,
    FIVE,
    FOUR,
    NAMED,
    OFFSET_WRIST,
    ONE,
    PLANAR_2,
    PLANAR_3,
    SCARA,
    SIX,
    asked,
    drawn_posture,
    turned,
)

WIDE = 2 * np.pi
ARM = Arm.load("community")
SOLVER = PoseSolver(ARM)
GEOMETRY = SOLVER.geometry
SEED = 7


def checked(found: NumericalSolutions) -> np.ndarray:
    """The angles (S, joints) of an answer that keeps what it promises."""
    constraint = Constraint.of(found.target)
    angles = np.array([solution.angles_rad for solution in found.solutions])
    for i, solution in enumerate(found.solutions):
        miss = constraint.miss(frames(found.arm.geometry, solution.angles_rad)[-1])
        np.testing.assert_allclose(miss, solution.miss, atol=1e-9)
        assert constraint.reached(miss)
        outside = [joint for joint in found.arm.moving if found.arm.ranges.excess(solution.angles_rad)[joint]]
        assert [each.joint for each in solution.rejections] == [joint + 1 for joint in outside]
        others = turned(np.delete(angles, i, axis=0) - angles[i])
        assert not len(others) or others.max(axis=1).min() > 1e-5
    usable = [solution.distance_rad for solution in found.solutions if not solution.rejections]
    assert usable == sorted(usable)
    return angles


@pytest.mark.long
@pytest.mark.parametrize(("arm", "fixed"), FITTING, ids=lambda value: getattr(value, "name", None))
def test_every_arm_finds_the_posture_that_made_the_pose(arm: Arm, fixed: tuple[str, ...]) -> None:
    rng = np.random.default_rng(31)
    solver = PoseSolver(arm)
    for _ in range(5):
        angles = drawn_posture(solver, rng)
        wanted = asked(forward(solver.geometry, angles), fixed)
        found = search(solver.moving, wanted, solver.home_rad)
        postures = checked(found)
        assert found.chosen is not None, found.reason
        assert turned(postures - angles).max(axis=1).min() < 1e-6, f"{arm.name}, seed 31"
        assert found.chosen.miss.position_mm < 1e-7
        assert found.chosen.miss.rotation_deg < 1e-7


@pytest.mark.slow
@pytest.mark.parametrize("name", ["paper", "abb_irb_140"])
def test_all_solutions_of_the_closed_form_are_found(name: str) -> None:
    rng = np.random.default_rng(32)
    in_mm = NAMED[name] if name == "paper" else scaled(NAMED[name], 1000.0)
    arm = MovingArm(in_mm, Ranges(np.full(6, -WIDE), np.full(6, WIDE)), tuple(range(6)))
    for _ in range(4):
        pose = forward(in_mm, rng.uniform(-np.pi, np.pi, 6))
        solutions = inverse(in_mm, pose)
        closed = solutions.angles_rad[0][solutions.outcome[0] == 0]
        found = checked(search(arm, Pose.of_matrix(pose), np.zeros(6)))
        assert len(found) == len(closed)
        for angles in closed:
            assert turned(found - angles).max(axis=1).min() < 1e-6


def scaled(geometry: Geometry, factor: float) -> Geometry:
    lengths = (tuple(factor * length for length in row) for row in (geometry.d, geometry.a))
    return Geometry(*lengths, geometry.alpha, geometry.offset)


def test_planar_and_scara_arms_have_their_two_elbows() -> None:
    for arm in (PLANAR_2, SCARA):
        solver = PoseSolver(arm)
        angles = np.radians([20.0, 70.0, 30.0][: len(arm.joints)])
        pose = forward(solver.geometry, angles)
        found = search(solver.moving, asked(pose, () if arm is PLANAR_2 else ("yaw",)), solver.home_rad)
        np.testing.assert_allclose(sorted(checked(found)[:, 1]), np.radians([-70.0, 70.0]), atol=1e-8)


@pytest.mark.parametrize("pitch", [90.0, -90.0, 89.9, -89.999, 0.0])
def test_a_tool_that_points_straight_down_is_no_special_case(pitch: float) -> None:
    solver = PoseSolver(
        replace(FOUR, joints=tuple(replace(each, range_deg=(-180, 180)) for each in FOUR.joints))
    )
    position = (150.0, 120.0, 60.0)
    found = search(solver.moving, Pose.of_angles(position, {"pitch": pitch}), solver.home_rad)
    assert found.chosen is not None, found.reason
    tool = forward(solver.geometry, found.chosen.angles_rad)
    np.testing.assert_allclose(tool[:3, 3], position, atol=1e-6)
    assert math.degrees(math.asin(max(-1.0, min(1.0, -tool[2, 0])))) == pytest.approx(pitch, abs=2e-5)
    checked(found)


def test_tolerances_decide_and_what_is_allowed_more_is_given_up_first() -> None:
    solver = PoseSolver(FOUR)
    yaw = math.degrees(math.atan2(120.0, 345.0)) + 1.0
    wanted = Pose.of_angles((345.0, 120.0, 60.0), {"roll": 90.0, "pitch": 0.0, "yaw": yaw})
    refused = search(solver.moving, wanted, solver.home_rad)
    assert refused.chosen is None
    assert f"misses it by {refused.nearest.miss}" in refused.reason
    wider = search(solver.moving, replace(wanted, tolerance_deg=1.01), solver.home_rad)
    assert wider.chosen is not None
    assert wider.nearest.miss.position_mm < 0.1


def test_the_nearest_posture_to_a_pose_out_of_reach_is_the_stretched_arm() -> None:
    solver = PoseSolver(PLANAR_2)
    found = search(solver.moving, Pose.of_angles((320.0, 240.0, 0.0), {}), solver.home_rad)
    assert found.chosen is None
    assert found.nearest.miss.position_mm == pytest.approx(50.0, abs=1e-6)
    np.testing.assert_allclose(found.nearest.angles_rad, [math.atan2(240.0, 320.0), 0.0], atol=1e-4)
    assert "bring the pose nearer to the arm" in found.reason
    within = Pose.of_angles((320.0, 240.0, 0.0), {})
    allowed = search(solver.moving, replace(within, tolerance_mm=50.5), solver.home_rad)
    assert allowed.chosen is not None


def test_postures_out_of_range_are_listed_with_the_joint() -> None:
    ranges = (
        replace(PLANAR_2.joints[0], range_deg=(-90.0, 90.0)),
        replace(PLANAR_2.joints[1], range_deg=(10, 170)),
    )
    solver = PoseSolver(replace(PLANAR_2, joints=ranges))
    pose = forward(solver.geometry, np.radians([20.0, 70.0]))
    found = search(solver.moving, asked(pose, ()), solver.home_rad)
    first, second = found.solutions
    assert first.rejections == ()
    (reason,) = second.rejections
    assert (reason.kind, reason.joint) == ("range", 2)
    assert reason.text == "joint 2 at -70 deg is 80 deg below its range 10 to 170"
    behind = forward(solver.geometry, np.radians([170.0, 70.0]))
    none = search(solver.moving, asked(behind, ()), solver.home_rad)
    assert none.chosen is None
    assert len(none.solutions) == 2
    assert "no posture within the joint ranges" in none.reason
    assert "\n  2         joint 1 at 170 deg is 80 deg above its range -90 to 90" in none.reason
    assert not any(solver.ranges.excess(none.nearest.angles_rad))


def test_more_joints_than_the_pose_asks_for_give_the_nearest_posture_within_the_ranges() -> None:
    rng = np.random.default_rng(33)
    solver = PoseSolver(SIX)
    for _ in range(10):
        start, there = drawn_posture(solver, rng), drawn_posture(solver, rng)
        wanted = asked(forward(solver.geometry, there), ())
        found = search(solver.moving, wanted, start)
        assert found.chosen is not None, f"seed 33: {found.reason}"
        assert found.leaves_free
        assert not any(solver.ranges.excess(found.chosen.angles_rad))
    beside = start + rng.uniform(-0.02, 0.02, 6)
    near = search(solver.moving, asked(forward(solver.geometry, beside), ()), start)
    # No farther than the posture that the pose was made of.
    assert near.nearest.distance_rad <= 1.05 * np.linalg.norm(beside - start)
    assert near.starts == 1


def test_an_axis_that_turns_nothing_leaves_a_joint_free() -> None:
    solver = PoseSolver(FIVE)
    pose = forward(solver.geometry, np.radians([20.0, 80.0, -60.0, 40.0, 10.0]))
    found = search(solver.moving, asked(pose, ("approach",)), solver.home_rad)
    assert found.leaves_free
    assert len(checked(found)) == 16
    start = np.radians([22.0, 78.0, -61.0, 41.0, -70.0])
    near = solver.nearest(asked(pose, ("approach",)), start)
    assert near.success
    assert near.angles_rad[4] == pytest.approx(start[4], abs=1e-9)


@pytest.mark.slow
def test_the_same_seed_gives_the_same_answer() -> None:
    solver = PoseSolver(OFFSET_WRIST)
    wanted = asked(forward(solver.geometry, np.radians([150.0, -20.0, -100.0, 90.0, -80.0, 200.0])), WHOLE)
    first, second = (search(solver.moving, wanted, solver.home_rad, seed=3) for _ in range(2))
    assert [each.angles_rad for each in first.solutions] == [each.angles_rad for each in second.solutions]
    assert first.starts == second.starts


def test_an_arm_without_any_length_only_turns() -> None:
    point = Geometry((5.0,), (0.0,), (0.0,), (0.0,))
    arm = MovingArm(point, Ranges(np.full(1, -np.pi), np.full(1, np.pi)), (0,))
    found = search(arm, Pose.of_matrix(forward(point, [0.5])), [0.0])
    assert found.nearest.angles_rad == pytest.approx([0.5])
    away = search(arm, Pose.of_matrix(np.eye(4)), [0.0])
    assert away.chosen is None
    assert away.nearest.miss.position_mm == 5.0


def test_one_joint_and_three_planar_ones_take_a_position_they_can_reach() -> None:
    one = PoseSolver(ONE)
    pose = forward(one.geometry, [1.0])
    assert search(one.moving, asked(pose, ()), [0.0]).nearest.angles_rad == pytest.approx([1.0])
    planar = PoseSolver(PLANAR_3)
    found = search(planar.moving, Pose.of_angles((100.0, 50.0, 5.0), {}), planar.home_rad)
    assert found.chosen is None  # 5 mm above the plane
    assert found.nearest.miss.position_mm == pytest.approx(5.0, abs=1e-3)


def postures(count: int) -> np.ndarray:  # type: ignore[type-arg]
    """Postures within the ranges, (count, joints) in rad."""
    low, high = SOLVER.ranges.low, SOLVER.ranges.high
    return np.random.default_rng(SEED).uniform(low, high, (count, len(low)))


def test_the_forearm_keeps_its_angle_when_the_arm_before_it_turns() -> None:
    still, moved = np.radians([[0.0, 0.0, 100.0, 0.0], [0.0, 30.0, 100.0, 0.0]])
    along = [forward(GEOMETRY, angles)[:3, 3] for angles in (still, moved)]
    elbow = [120 * np.array([np.sin(low), 0.0, np.cos(low)]) for low in (0.0, np.radians(30.0))]
    np.testing.assert_allclose(along[1] - along[0], elbow[1] - elbow[0], atol=1e-9)


@pytest.mark.parametrize("moving", [(0, 1, 2), (0, 1, 2, 3), (1,), (2, 3)])
def test_the_descent_knows_how_the_cost_changes(moving: tuple[int, ...]) -> None:
    """Its gradient against differences of its cost, whichever joints move."""
    from armtempo.kinematics.constraint import Constraint
    from armtempo.kinematics.descent import PoseProblem, _posture, _system

    aim, *others = postures(6)
    constraint = Constraint.of(Pose.of_matrix(forward(GEOMETRY, aim)))
    problem = PoseProblem(GEOMETRY, constraint, moving)
    step = 1e-6
    for angles in others:
        _, gradient = _system(problem, _posture(problem, angles.tolist()))
        by_differences = [
            (
                _posture(problem, (angles + step * unit).tolist()).cost
                - _posture(problem, (angles - step * unit).tolist()).cost
            )
            / (4 * step)
            for unit in np.eye(4)[list(moving)]
        ]
        np.testing.assert_allclose(gradient, by_differences, rtol=1e-6, atol=1e-3 * max(map(abs, gradient)))


@pytest.mark.slow
def test_the_solver_finds_its_postures() -> None:
    """Position only: the hand, which the rods keep level, follows from it."""
    for angles in postures(10):
        angles[3] = 0.0
        pose = forward(GEOMETRY, angles)
        for wanted in (Pose.of_matrix(pose), Pose.of_angles(pose[:3, 3].tolist(), {})):
            answer = SOLVER.solve(wanted, np.radians([0, 10, 100, 0]).tolist())
            assert answer.success, answer.reason
            np.testing.assert_allclose(answer.tool[:3, 3], pose[:3, 3], atol=1e-5)
            np.testing.assert_allclose(answer.angles_rad, angles, atol=1e-6)
            near = SOLVER.nearest(wanted, answer.angles_rad)
            assert near.success
            np.testing.assert_allclose(near.angles_rad, angles, atol=1e-6)


def test_the_closed_form_refuses_it() -> None:
    geometry = Geometry.of(Arm.load("parol6"))
    assert refusals(geometry) == []
    assert refusals(replace(geometry, linked=(2,))) == ["a parallel linkage turns joint 3"]


@pytest.mark.parametrize("name", [*NAMED, "community"])
def test_floats_and_arrays_of_any_shape_turn_alike(name: str) -> None:
    geometry = NAMED.get(name, GEOMETRY)
    angles = np.random.default_rng(SEED).uniform(-3, 3, (2, 5, len(geometry.d)))
    found = array_frames(geometry, angles)
    for place in np.ndindex(2, 5):
        one = all_frames(geometry, angles[place].tolist())
        for frame, wanted in zip(found, one, strict=True):
            for column, axis in enumerate(frame):
                turned = [np.broadcast_to(part, (2, 5))[place] for part in axis]
                np.testing.assert_allclose(turned, wanted[:3, column], atol=1e-12 * geometry.reach)


def test_a_parallelogram_turns_the_joint_behind_back() -> None:
    assert GEOMETRY.linked == (2, 3)
    np.testing.assert_allclose(GEOMETRY.turns([0.1, 0.2, 0.4, 0.8]), [0.1, 0.2, 0.2, 0.4])


@pytest.mark.parametrize(
    ("arm", "position_mm", "said"),
    [
        (
            "ar4",
            (900, 0, 300),
            r"283\.1 mm .*which comes to x 621\.\d, y -?0(\.\d)?, z 249\.\d mm in the base",
        ),
        (
            "ar4",
            (300, 0, 300),
            r"joint 5 at the end of its range, 105 deg.* position is reached with roll .*, pitch ",
        ),
        ("community_rail", (100, 1500, 50), r"joint 2 at the end of its range, 300 mm"),
    ],
)
def test_a_pose_out_of_reach_is_told_how_near_the_arm_comes(
    arm: str, position_mm: tuple[float, ...], said: str
) -> None:
    """A tolerance, which is the cure of a pose that is nearly reached, is not."""
    moved = Arm.of(arm)
    turns = {"roll": 0.0, "pitch": 180.0 if position_mm[0] == 900 else 0.0, "yaw": 0.0}
    target = Pose.of_angles(position_mm, turns if arm == "ar4" else {})
    far = search(MovingArm.of(moved), target, np.radians(moved.all_home_deg).tolist())
    assert re.search(said, far.reason.splitlines()[0])
    assert "tolerance_mm" not in far.reason
    near = replace(far, nearest=replace(far.nearest, miss=Miss(0.5, 0.5)))
    assert "allow more by tolerance_mm" in near.reason
