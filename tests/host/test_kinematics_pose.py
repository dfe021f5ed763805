"""Poses from matrices, roll-pitch-yaw, quaternions and files; and what is not a pose."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from armtempo.basics.errors import InputError
from armtempo.kinematics import pose_file
from armtempo.model import pose
from armtempo.model.tool_pose import WHOLE
from scipy.spatial.transform import Rotation

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
    poses = pose_file.read(file)
    assert len(poses) == 4
    for found in poses:
        np.testing.assert_allclose(found.matrix, MATRIX, atol=1e-14)
        assert found.fixed == WHOLE


def test_a_line_may_leave_angles_free(tmp_path: Path) -> None:
    file = tmp_path / "poses.txt"
    file.write_text("1 2 3\n1 2 3 - -90 -\n1, 2, 3, 5, -90, -\n1 2 3 - - 20\n1 2 3 - - -\n")
    poses = pose_file.read(file)
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
        pose_file.read(file)
    assert words in str(caught.value)


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        pose_file.read(tmp_path / "none.txt")
