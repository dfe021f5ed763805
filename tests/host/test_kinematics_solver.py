"""One solver for every arm: the nearest posture for a jog, and all postures with the reasons."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from armtempo.basics.errors import InputError
from armtempo.kinematics import choose, forward
from armtempo.kinematics.solver import CLOSED_FORM, NUMERICAL, PoseSolver
from armtempo.model import pose
from armtempo.model.arm import Arm
from armtempo.model.tool_pose import WHOLE, Pose

from tests.host.arms import (
    FITTING,
    FIVE,
    FOUR,
    OFFSET_WRIST,
    PAPER_ARM,
    PLANAR_2,
    SIX,
    THREE,
    asked,
    drawn_posture,
)

CLASS = [(SIX, WHOLE), *FITTING]


def named(value: object) -> str | None:
    return getattr(value, "name", None)


@pytest.mark.parametrize(("arm", "fixed"), CLASS, ids=named)
def test_a_jog_stays_near_and_meets_each_pose(arm: Arm, fixed: tuple[str, ...]) -> None:
    """Along a way of small steps each answer is a small step of the joints: the arm never changes its branch."""
    rng = np.random.default_rng(51)
    solver = PoseSolver(arm)
    start, end = drawn_posture(solver, rng), drawn_posture(solver, rng)
    end = start + 0.3 * (end - start)
    at = start.tolist()
    for part in np.linspace(0.0, 1.0, 40):
        there = start + part * (end - start)
        found = solver.nearest(asked(forward(solver.geometry, there), fixed), at)
        assert found.success, f"{arm.name}, seed 51: {found.reason}"
        assert (found.reason, found.miss.position_mm < 1e-6, found.miss.rotation_deg < 1e-6) == (
            "",
            True,
            True,
        )
        assert found.change_rad == pytest.approx(np.abs(np.subtract(found.angles_rad, at)).max())
        assert found.change_rad < 0.2
        np.testing.assert_allclose(found.angles_rad, there, atol=1e-4)
        at = list(found.angles_rad)


@pytest.mark.parametrize("chained", [False, True])
def test_many_at_once_are_as_one_by_one(chained: bool) -> None:
    """They end where one is singular or out of reach, and if there is no closed form."""
    rng = np.random.default_rng(52)
    solver = PoseSolver(SIX)
    start, end = drawn_posture(solver, rng), drawn_posture(solver, rng)
    there = start + np.linspace(0.0, 0.5, 30)[:, None] * (end - start)
    poses = forward(solver.geometry, there)
    found = solver.nearest_of_many(poses, start if chained else there, (0.02, 0.02))
    assert len(found) == 30, "seed 52"
    at = start.tolist()
    for number, posture in enumerate(found):
        one = solver.nearest(Pose.of_matrix(poses[number]), at if chained else there[number].tolist())
        np.testing.assert_allclose(posture, one.angles_rad, atol=1e-12)
        at = list(one.angles_rad)

    straight = there.copy()
    straight[20, 4] = 0.0
    far = poses.copy()
    far[12, 0, 3] += 1e6
    assert len(solver.nearest_of_many(forward(solver.geometry, straight), straight, (0.02, 0.02))) == 20
    assert len(solver.nearest_of_many(far, there, (0.02, 0.02))) == 12
    assert len(solver.nearest_of_many(poses, there, (1e-20, 1e-20))) == 0
    assert PoseSolver(FIVE).nearest_of_many(poses, np.zeros(5), (0.02, 0.02)).shape == (0, 5)


def test_nearest_is_the_choice_of_the_closed_form() -> None:
    rng = np.random.default_rng(52)
    solver = PoseSolver(SIX)
    for _ in range(100):
        matrix = forward(solver.geometry, drawn_posture(solver, rng))
        start = drawn_posture(solver, rng)
        found = solver.nearest(Pose.of_matrix(matrix), start)
        choice = choose(solver.geometry, matrix, solver.ranges, start)
        assert choice.chosen is not None
        assert found.method == CLOSED_FORM
        np.testing.assert_allclose(found.angles_rad, choice.chosen.angles_rad, atol=1e-12)


def test_a_jog_out_of_reach_ends_at_the_nearest_posture_with_the_miss() -> None:
    for arm in (SIX, FOUR):
        solver = PoseSolver(arm)
        found = solver.nearest(Pose.of_angles((2000.0, 0.0, 200.0), {}), solver.home_rad)
        assert not found.success
        assert found.miss.position_mm > 1000.0
        assert found.reason.startswith("the arm does not reach the pose from here; the nearest posture")
        assert f"misses it by {found.miss}" in found.reason
        assert not any(solver.ranges.excess(found.angles_rad))
    whole = PoseSolver(SIX).nearest(Pose.of_angles((2000.0, 0, 0), dict.fromkeys(WHOLE, 0.0)), [0.0] * 6)
    assert (whole.success, whole.method) == (False, NUMERICAL)


def test_a_jog_to_the_end_of_a_range_names_the_joint_and_stays_within() -> None:
    arm = replace(PLANAR_2, joints=(replace(PLANAR_2.joints[0], range_deg=(-30.0, 30.0)), PLANAR_2.joints[1]))
    solver = PoseSolver(arm)
    beyond = forward(solver.geometry, np.radians([33.0, 60.0]))
    found = solver.nearest(asked(beyond, ()), np.radians([29.0, 60.0]))
    assert not found.success
    assert found.reason.startswith(
        "joint 1 at 33 deg is 3 deg above its range -30 to 30; the nearest posture"
    )
    assert math.degrees(found.angles_rad[0]) == pytest.approx(30.0)
    assert 0.1 < found.miss.position_mm < 20.0


def test_joints_without_a_motor_stay_in_a_jog() -> None:
    solver = PoseSolver(PAPER_ARM)
    start = np.radians([10.0, -60.0, 40.0, 5.0, 6.0, 7.0])
    moved = forward(solver.geometry, start + np.radians([1.0, 1.0, -2.0, 0.0, 0.0, 0.0]))
    found = solver.nearest(asked(moved, ()), start)
    assert found.success
    np.testing.assert_array_equal(found.angles_rad[3:], start[3:])
    # A whole pose that the three joints reach is met too, and one that they do not is refused.
    assert solver.nearest(Pose.of_matrix(moved), start).success
    turned = moved @ pose.from_rpy((0, 0, 0), (0, 0, 20))
    assert not solver.nearest(Pose.of_matrix(turned), start).success


def test_solve_chooses_the_nearest_and_says_where_the_tool_is() -> None:
    rng = np.random.default_rng(53)
    for arm, fixed in ((SIX, WHOLE), (FOUR, ("pitch",)), (FIVE, ("roll", "pitch")), (THREE, ())):
        solver = PoseSolver(arm)
        there = drawn_posture(solver, rng)
        answer = solver.solve(asked(forward(solver.geometry, there), fixed), there)
        assert answer.success
        np.testing.assert_allclose(answer.angles_rad, there, atol=1e-6)
        np.testing.assert_allclose(answer.tool, forward(solver.geometry, there), atol=1e-5)
        assert max(answer.miss) < 1e-6
        assert (answer.choice is None) == (arm is not SIX)


def test_a_whole_pose_a_little_out_of_reach_is_met_within_its_tolerance() -> None:
    """The closed form has none of the eight; the numerical search comes within 0.1 mm."""
    solver = PoseSolver(SIX)
    stretch = -math.atan2(360.0, 120.0)  # of joint 3, by d4 and a3
    matrix = forward(solver.geometry, [0.2, -0.5, stretch, 0.3, 0.4, 0.5])
    shoulder = np.array([-100.0 * math.cos(0.2), -100.0 * math.sin(0.2), 130.0])
    out = matrix[:3, 3] - 40.0 * matrix[:3, 2] - shoulder
    matrix[:3, 3] += 0.05 * out / np.linalg.norm(out)
    answer = solver.solve(Pose.of_matrix(matrix), solver.home_rad)
    assert answer.success, answer.reason
    assert answer.choice is not None
    assert answer.choice.chosen is None
    assert 0.0 < answer.miss.position_mm <= 0.1
    assert answer.miss.rotation_deg <= 0.1


@pytest.mark.slow
def test_a_refusal_lists_the_reasons_solution_by_solution() -> None:
    solver = PoseSolver(SIX)
    answer = solver.solve(Pose.of_angles((900.0, 0.0, 300.0), dict.fromkeys(WHOLE, 0.0)), solver.home_rad)
    assert not answer.success
    first, columns, front, rear = answer.reason.splitlines()
    assert "bring the pose nearer to the arm" in first
    assert columns.split() == ["solution", "why", "not"]
    assert front.startswith("  1, 2, 3, 4  out of reach by 328.941 mm")
    assert rear.startswith("  5, 6, 7, 8  out of reach by 131.02 mm")


def test_the_example_in_the_docs_runs() -> None:
    page = Path(__file__).parents[2] / "host" / "docs" / "kinematics.md"
    block = page.read_text(encoding="utf-8").split("```python\n")[1].split("```")[0]
    names: dict[str, Any] = {}
    exec(block, names)
    assert names["answer"].success
    assert names["jog"].success
    assert names["many"].angles_rad.shape == (1000, 8, 6)
    np.testing.assert_allclose(names["one"].angles_rad, names["many"].angles_rad[0], atol=1e-12)


def test_another_number_of_angles_is_refused() -> None:
    solver = PoseSolver(OFFSET_WRIST)
    wanted = Pose.of_angles((300.0, 0.0, 200.0), {})
    for call in (solver.nearest, solver.solve):
        with pytest.raises(InputError, match="3 angles given, the arm has 6 joints"):
            call(wanted, [0.0, 0.0, 0.0])
