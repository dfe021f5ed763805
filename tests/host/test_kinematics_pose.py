"""Poses in every form, what is not a pose, and what a target asks of the tool."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from armtempo.basics.errors import InputError
from armtempo.cli import kinematics
from armtempo.kinematics import forward
from armtempo.kinematics.constraint import Constraint, Miss
from armtempo.kinematics.descent import PoseProblem, _posture, _system
from armtempo.kinematics.forward import Frame
from armtempo.kinematics.solver import PoseSolver
from armtempo.model import pose
from armtempo.model.tool_pose import APPROACH, CONSTRAINTS, WHOLE, Pose
from scipy.spatial.transform import Rotation

from tests.host.arms import OFFSET_WRIST, asked

TURN = Rotation.from_euler("xyz", [10.0, -20.0, 130.0], degrees=True)
MATRIX = np.block([[TURN.as_matrix(), np.array([[1.0], [2.0], [3.0]])], [np.zeros((1, 3)), np.ones((1, 1))]])


def test_roll_pitch_yaw_turn_about_the_base_axes_in_that_order() -> None:
    np.testing.assert_allclose(pose.from_rpy((1, 2, 3), (10, -20, 130)), MATRIX, atol=1e-15)


def test_quarter_turns_are_exact() -> None:
    found = pose.from_rpy((0, 0, 0), (0, -90, 180))
    np.testing.assert_array_equal(found[:3, :3], [[0, 0, 1], [0, -1, 0], [1, 0, 0]])


def test_quaternion_real_part_first_either_sign() -> None:
    x, y, z, w = TURN.as_quat()
    np.testing.assert_allclose(pose.from_quaternion((1, 2, 3), (w, x, y, z)), MATRIX, atol=1e-15)
    np.testing.assert_allclose(pose.from_quaternion((1, 2, 3), (-w, -x, -y, -z)), MATRIX, atol=1e-15)


def test_an_exact_matrix_stays_as_it_is() -> None:
    np.testing.assert_array_equal(pose.checked(MATRIX), MATRIX)
    np.testing.assert_array_equal(pose.checked(MATRIX[:3]), MATRIX)


def test_a_matrix_printed_with_four_digits_becomes_a_rotation() -> None:
    found = pose.checked(np.round(MATRIX, 4))
    np.testing.assert_allclose(found[:3, :3] @ found[:3, :3].T, np.eye(3), atol=1e-14)
    np.testing.assert_allclose(found, MATRIX, atol=1e-4)


def spoilt(row: int, column: int, value: float) -> np.ndarray:
    matrix = MATRIX.copy()
    matrix[row, column] = value
    return matrix


@pytest.mark.parametrize(
    ("matrix", "words"),
    [
        (spoilt(0, 0, 2.0), "not a rotation"),
        (spoilt(0, 3, np.nan), "finite"),
        (spoilt(1, 1, np.inf), "finite"),
        (spoilt(0, 3, 1e200), "at most 1e"),
        (spoilt(3, 3, 2.0), "last row of a pose is 0 0 0 1, not 0 0 0 2"),
        (MATRIX * [1, 1, -1, 1], "left-handed"),
        (np.eye(3), "4 rows of 4 numbers"),
        (np.diag([0.0, 0.0, 0.0, 1.0]), "not a rotation"),
    ],
)
def test_what_is_no_pose(matrix: np.ndarray, words: str) -> None:
    with pytest.raises(InputError, match="pose 7") as caught:
        pose.checked(matrix, "pose 7")
    assert words in str(caught.value)


@pytest.mark.parametrize("quaternion", [(0, 0, 0, 0), (1, 1, 0, 0), (np.nan, 0, 0, 0), (np.inf, 0, 0, 0)])
def test_a_quaternion_must_have_length_one(quaternion: tuple[float, ...]) -> None:
    with pytest.raises(InputError, match="length 1"):
        pose.from_quaternion((0, 0, 0), quaternion)


@pytest.mark.parametrize("angle", [np.nan, np.inf])
def test_angles_must_be_finite(angle: float) -> None:
    with pytest.raises(InputError, match="finite"):
        pose.from_rpy((0, 0, 0), (angle, 0, 0))


@pytest.mark.parametrize("pitch", [-90.0, -89.0, 0.0, 30.0, 90.0])
def test_roll_pitch_yaw_and_quaternion_are_read_back(pitch: float) -> None:
    rng = np.random.default_rng(1)
    for roll, yaw in rng.uniform(-180.0, 180.0, (50, 2)):
        matrix = pose.from_rpy((1, 2, 3), (roll, pitch, yaw))
        np.testing.assert_allclose(pose.from_rpy((1, 2, 3), pose.to_rpy_deg(matrix)), matrix, atol=1e-9)
        quaternion = pose.to_quaternion(matrix)
        assert quaternion[0] >= 0.0
        np.testing.assert_allclose(pose.from_quaternion((1, 2, 3), quaternion), matrix, atol=1e-14)
        if abs(pitch) < 89.5:
            np.testing.assert_allclose(pose.to_rpy_deg(matrix), (roll, pitch, yaw), atol=1e-9)


def test_half_turns_and_zeros_are_read_back_as_people_write_them() -> None:
    assert str(tuple(pose.to_rpy_deg(pose.from_rpy((0, 0, 0), (180, 0, -180))))) == "(180.0, 0.0, 180.0)"
    assert str(tuple(pose.to_rpy_deg(pose.from_rpy((0, 0, 0), (0, -90, 0))))) == "(0.0, -90.0, 0.0)"
    assert str(tuple(pose.to_quaternion(pose.from_rpy((0, 0, 0), (180, 0, 0))))) == "(0.0, 1.0, 0.0, 0.0)"


def test_file_of_poses_in_every_form(tmp_path: Path) -> None:
    x, y, z, w = TURN.as_quat()
    file = tmp_path / "poses.txt"
    file.write_text(
        "# a comment\n\n"
        "1 2 3 10 -20 130   # position and roll, pitch, yaw\n"
        f"1, 2, 3, {w:.17g}, {x:.17g}, {y:.17g}, {z:.17g}\n"
        f"{' '.join(map(repr, map(float, MATRIX[:3].ravel())))}\n"
        f"{' '.join(map(repr, map(float, MATRIX.ravel())))}\n"
    )
    poses = kinematics.read(file)
    assert len(poses) == 4
    for found in poses:
        np.testing.assert_allclose(found.matrix, MATRIX, atol=1e-14)
        assert found.fixed == WHOLE


def test_a_line_may_leave_angles_free(tmp_path: Path) -> None:
    file = tmp_path / "poses.txt"
    file.write_text("1 2 3\n1 2 3 - -90 -\n1, 2, 3, 5, -90, -\n1 2 3 - - 20\n1 2 3 - - -\n")
    poses = kinematics.read(file)
    assert [each.fixed for each in poses] == [(), ("pitch",), ("roll", "pitch"), ("yaw",), ()]
    assert [each.constraints for each in poses] == [3, 4, 5, 4, 3]
    np.testing.assert_allclose(poses[1].matrix, pose.from_rpy((1, 2, 3), (0, -90, 0)))
    np.testing.assert_allclose(poses[2].matrix, pose.from_rpy((1, 2, 3), (5, -90, 0)))


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (
            b"1 2 3 0 0 0\n1 2\n",
            "line 2: 2 numbers are not a pose; give 3 (x y z: position only), 6 (x y z roll",
        ),
        (b"1 2 - 0 0 0\n", "line 1: '-' is not a number"),
        (b"1 2 3 10 - 20\n", "line 1: roll and yaw without pitch do not define an orientation"),
        (b"1 2 three 0 0 0\n", "line 1: 'three' is not a number"),
        (b"\n1 2 nan 0 0 0\n", "line 2: 'nan' is not a finite number"),
        (b"# nothing\n", "no pose in it"),
        (b"\xff\xfe\x00", "cannot be read as text"),
    ],
)
def test_a_wrong_file_is_refused_with_line_and_reason(tmp_path: Path, content: bytes, words: str) -> None:
    file = tmp_path / "poses.txt"
    file.write_bytes(content)
    with pytest.raises(InputError, match=r"poses\.txt") as caught:
        kinematics.read(file)
    assert words in str(caught.value)


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        kinematics.read(tmp_path / "none.txt")


# what a target asks of the tool: how far a tool is from it, and the derivatives that the descent goes by


SOLVER = PoseSolver(OFFSET_WRIST)
EVERY = list(CONSTRAINTS)


def miss(wanted: Pose, stands: np.ndarray) -> Miss:
    """How far a tool with the pose ``stands`` (4, 4) is from the target."""
    x, y, z, origin = (tuple(stands[:3, column].tolist()) for column in range(4))
    return Constraint.of(wanted).miss(Frame(x, y, z, origin))


TARGET = pose.from_rpy((10, 20, 30), (15, 40, -70))


@pytest.mark.parametrize("fixed", EVERY, ids=str)
def test_a_tool_at_its_target_misses_nothing(fixed: tuple[str, ...]) -> None:
    assert max(miss(asked(TARGET, fixed), TARGET)) < 1e-7


@pytest.mark.parametrize("fixed", EVERY, ids=str)
def test_the_position_always_counts(fixed: tuple[str, ...]) -> None:
    moved = TARGET + np.array([[0, 0, 0, 3.0], [0, 0, 0, 0], [0, 0, 0, 4.0], [0, 0, 0, 0]])
    assert miss(asked(TARGET, fixed), moved).position_mm == pytest.approx(5.0)


@pytest.mark.parametrize(
    ("fixed", "rpy", "off"),
    [
        (("roll", "pitch", "yaw"), (15, 40, -60), 10.0),
        (("pitch",), (99, 43, 12), 3.0),
        (("roll",), (17, -20, 100), 2.0),
        (("yaw",), (80, 10, -75), 5.0),
        (("yaw",), (15, 40, 110), 180.0),
        (("roll", "pitch"), (15, 46, 33), 6.0),
        (("pitch", "yaw"), (-100, 47, -70), 7.0),
        ((APPROACH,), (15, 40, -70), 0.0),
        ((), (1, 2, 3), 0.0),
    ],
    ids=str,
)
def test_only_what_is_asked_for_counts(
    fixed: tuple[str, ...], rpy: tuple[float, float, float], off: float
) -> None:
    stands = pose.from_rpy((10, 20, 30), rpy)
    assert miss(asked(TARGET, fixed), stands).rotation_deg == pytest.approx(off, abs=1e-6)


def test_turning_about_the_approach_costs_nothing_and_tilting_it_does() -> None:
    spun = TARGET @ pose.from_rpy((0, 0, 0), (0, 0, 77))
    tilted = spun @ pose.from_rpy((0, 0, 0), (4, 0, 0))
    assert miss(asked(TARGET, (APPROACH,)), spun).rotation_deg == pytest.approx(0.0, abs=1e-6)
    assert miss(asked(TARGET, (APPROACH,)), tilted).rotation_deg == pytest.approx(4.0, abs=1e-6)


@pytest.mark.parametrize("fixed", EVERY, ids=str)
def test_the_gradient_is_that_of_the_cost(fixed: tuple[str, ...]) -> None:
    rng = np.random.default_rng(41)
    problem = PoseProblem(SOLVER.geometry, Constraint.of(asked(TARGET, fixed)), tuple(range(6)))
    for _ in range(5):
        angles = rng.uniform(-2, 2, 6)
        _, gradient = _system(problem, _posture(problem, angles.tolist()))
        for joint in range(6):
            nudge = np.eye(6)[joint] * 1e-6
            ends = [_posture(problem, (angles + sign * nudge).tolist()).cost for sign in (1, -1)]
            slope = (ends[0] - ends[1]) / 2e-6
            assert 2.0 * gradient[joint] == pytest.approx(slope, rel=1e-5, abs=1e-3), "seed 41"


@pytest.mark.parametrize("fixed", EVERY, ids=str)
def test_at_a_solution_the_second_derivatives_are_those_of_the_cost(fixed: tuple[str, ...]) -> None:
    rng = np.random.default_rng(42)
    angles = rng.uniform(-1, 1, 6)
    stands = forward(SOLVER.geometry, angles)
    problem = PoseProblem(SOLVER.geometry, Constraint.of(asked(stands, fixed)), tuple(range(6)))
    lower, _ = _system(problem, _posture(problem, angles.tolist()))
    step = 1e-5
    for joint in range(6):
        nudge = np.eye(6)[joint] * step
        ends = [_posture(problem, (angles + sign * nudge).tolist()).cost for sign in (1, -1)]
        assert 2.0 * lower[joint][joint] == pytest.approx(sum(ends) / step**2, rel=1e-3, abs=1e-2)


def test_an_approach_of_any_length_is_a_direction() -> None:
    found = Pose.of_approach((1, 2, 3), (0, 0, -5))
    matrix = pose.checked(found.matrix)
    np.testing.assert_allclose(matrix[:3, 2], (0, 0, -1))
    assert found.constraints == 5
    rng = np.random.default_rng(43)
    for direction in rng.normal(size=(20, 3)):
        matrix = pose.checked(Pose.of_approach((1, 2, 3), direction).matrix)
        np.testing.assert_allclose(matrix[:3, 2], direction / np.linalg.norm(direction), atol=1e-12)


def test_targets_that_make_no_sense_are_refused() -> None:
    rows = tuple(map(tuple, np.eye(4).tolist()))
    with pytest.raises(
        InputError, match=r"cannot fix roll\+yaw of its orientation; it may fix nothing, roll, "
    ):
        Pose(rows, fixed=("roll", "yaw"))
    with pytest.raises(
        InputError, match=r"tolerances of 0 mm and 0\.1 deg are not allowed; give 1e-06 to 1000 mm"
    ):
        Pose(rows, tolerance_mm=0.0)
    with pytest.raises(InputError, match="tolerance_deg is nan"):
        Pose(rows, tolerance_deg=math.nan)


def test_targets_say_what_they_ask_for() -> None:
    words = [asked(TARGET, fixed).description for fixed in ((), ("pitch",), ("roll", "pitch", "yaw"))]
    assert words == ["position only", "position and pitch", "whole pose"]
