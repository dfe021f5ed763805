"""Job files: the shipped one, and the message for everything that can be wrong in one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from armtempo.basics.errors import InputError
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.tool_pose import Pose

ARM = Arm.paper()
TWO = "via_deg = [[0, -60, 40], [20, -75, 50]]\n"


def written(tmp_path: Path, text: str) -> Path:
    """A job file with this text after its name."""
    path = tmp_path / "job.toml"
    path.write_text('name = "t"\n' + text)
    return path


def test_the_shipped_job_is_table_3_with_its_misprint_mended() -> None:
    job = Job.paper(ARM)
    assert [via[2] for via in job.via if not isinstance(via, Pose)] == [40, 50, 70, 40, 10, -20, -52]
    assert (job.degree, job.timing, job.optimiser, job.population, job.iterations) == (
        5,
        "per-joint",
        "acs",
        10,
        500,
    )
    assert job.bounds_s == (0.1, 3.0)


def test_poses_and_angles_may_be_mixed(tmp_path: Path) -> None:
    matrix = "[[0, 0, -1, -536.404], [0, 1, 0, 0], [1, 0, 0, 434.698], [0, 0, 0, 1]]"
    text = f"[[via]]\nangles_deg = [0, -60, 40]\n[[via]]\nmatrix = {matrix}\n"
    job = Job.load(written(tmp_path, text), ARM)
    assert job.via[0] == (0, -60, 40)
    assert isinstance(job.via[1], Pose)
    assert job.via[1].matrix[0] == (0, 0, -1, -536.404)


@pytest.mark.parametrize(
    "turned", ["rpy_deg = [0, -90, 0]", "quaternion = [0.7071067811865476, 0, -0.7071067811865476, 0]"]
)
def test_poses_may_be_positions_that_are_turned(turned: str, tmp_path: Path) -> None:
    text = f"[[via]]\nangles_deg = [0, -60, 40]\n[[via]]\nposition_mm = [-536.404, 0, 434.698]\n{turned}\n"
    via = Job.load(written(tmp_path, text), ARM).via[1]
    assert isinstance(via, Pose)
    wanted = ((0, 0, -1, -536.404), (0, 1, 0, 0), (1, 0, 0, 434.698), (0, 0, 0, 1))
    np.testing.assert_allclose(via.matrix, wanted, atol=1e-12)


@pytest.mark.parametrize(
    ("keys", "fixed"),
    [
        ("", ()),
        ("pitch_deg = -90", ("pitch",)),
        ("yaw_deg = 20", ("yaw",)),
        ("roll_deg = 20", ("roll",)),
        ("roll_deg = 0\npitch_deg = -90", ("roll", "pitch")),
        ("pitch_deg = 5\nyaw_deg = -90", ("pitch", "yaw")),
        ("roll_deg = 1\npitch_deg = 5\nyaw_deg = -90", ("roll", "pitch", "yaw")),
        ("approach = [0, 0, -2]", ("approach",)),
    ],
)
def test_a_position_may_ask_for_a_part_of_the_orientation(
    keys: str, fixed: tuple[str, ...], tmp_path: Path
) -> None:
    text = f"[[via]]\nangles_deg = [0, -60, 40]\n[[via]]\nposition_mm = [300, 0, 60]\n{keys}\n"
    via = Job.load(written(tmp_path, text), ARM).via[1]
    assert isinstance(via, Pose)
    assert via.fixed == fixed
    assert (via.tolerance_mm, via.tolerance_deg) == (0.1, 0.1)
    assert [row[3] for row in via.matrix] == [300, 0, 60, 1]
    wider = Job.load(written(tmp_path, text + "tolerance_mm = 2\ntolerance_deg = 3.5\n"), ARM).via[1]
    assert isinstance(wider, Pose)
    assert (wider.tolerance_mm, wider.tolerance_deg) == (2.0, 3.5)


@pytest.mark.parametrize(
    ("via", "said"),
    [
        (
            "position_mm = [1, 2, 3]\nrpy_deg = [0, 0, 0]\npitch_deg = 3",
            "give position_mm alone, with one of",
        ),
        (
            "position_mm = [1, 2, 3]\napproach = [0, 0, 1]\nyaw_deg = 3",
            "give position_mm alone, with one of",
        ),
        (
            "position_mm = [1, 2, 3]\nroll_deg = 0\nyaw_deg = 3",
            "roll and yaw without pitch do not define an orientation",
        ),
        ("position_mm = [1, 2, 3]\napproach = [0, 0, 0]", "a direction such as 0 0 -1"),
        ("position_mm = [1, 2, 3]\npitch_deg = nan", "via P0.pitch_deg"),
        ("position_mm = [1, 2, 3]\ntolerance_mm = 0", "via P0.tolerance_mm = 0 is not allowed"),
        ("position_mm = [1, 2, 3]\ntolerance_deg = 200", "via P0.tolerance_deg = 200 is not allowed"),
        ("angles_deg = [0, 0, 0]\ntolerance_deg = 2", "via P0.tolerance_deg: unknown key"),
        ("position_mm = [1, 2]\nrpy_deg = [0, 0, 0]", "via P0.position_mm = [1, 2]"),
        ("position_mm = [1, 2, 3]\nrpy_deg = [0, 0, nan]", "via P0.rpy_deg"),
        ("position_mm = [1, 2, 3]\nquaternion = [1, 1, 0, 0]", "length 1.41421"),
        ("position_mm = [1, 2, 3]\nrpy_deg = [0, 0, 0]\nangles_deg = [0, 0, 0]", "exactly one of"),
        ("position_mm = [1, 2, 3]\nrpy_deg = [0, 0, 0]\nrpy = 1", "rpy"),
        ("posture_deg = [0, 0, 0, 0, 0, 0]", "exactly one of angles_deg, matrix, position_mm and posture"),
    ],
)
def test_what_can_be_wrong_with_a_turned_position(via: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        Job.load(written(tmp_path, f"[[via]]\n{via}\n[[via]]\nangles_deg = [0, -60, 40]\n"), ARM)
    assert said in str(caught.value)
    assert "job.toml" in str(caught.value)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", ["via_deg is missing", "[[via]]"]),
        ("via_deg = []\n", ["via_deg = []", "at least 2 lists"]),
        ("via_deg = [[0, -60, 40]]\n", ["1 via point is not a motion", "at least 2"]),
        ("via_deg = [[0, -60, 40], [20, -75]]\n", ["via_deg P1 = [20, -75]", "list of 3 numbers"]),
        ("via_deg = [[0, -60, 40], [20, nan, 50]]\n", ["via_deg P1", "list of 3 numbers"]),
        ("via_deg = [[0, -60, 40], [200, -75, 50]]\n", ["via_deg P1", "range of joint 1, -10 to 190"]),
        (TWO + "degree = 4\n", ["degree = 4", "3, 5"]),
        (TWO + 'timing = "fast"\n', ["timing = 'fast'", "'shared', 'per-joint'"]),
        (TWO + 'optimiser = "magic"\n', ["optimiser = 'magic'", "'acs'"]),
        (TWO + "population = 2\n", ["population = 2", "from 4"]),
        (TWO + "bounds_s = [3.0, 0.1]\n", ["bounds_s", "shorter first"]),
        (TWO + "seeds = 3\n", ["seeds: unknown key", "'seed'"]),
        ("[[via]]\nmatrix = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\n", ["via P0.matrix", "4 rows of 4 numbers"]),
        (f"via_deg = [[0, -60, 1{'0' * 400}], [20, -75, 50]]\n", ["via_deg P0", "list of 3 numbers"]),
        (f"seed = 1{'0' * 5000}\n", ["not valid TOML"]),
        ("via_deg = " + "[" * 5000 + "]" * 5000, ["not valid TOML"]),
        ("[[via]]\nangle = 3\n", ["via P0: exactly one of angles_deg, matrix"]),
    ],
)
def test_what_is_wrong_is_said(tmp_path: Path, text: str, said: list[str]) -> None:
    path = written(tmp_path, text)
    with pytest.raises(InputError) as error:
        Job.load(path, ARM)
    for part in [str(path), *said]:
        assert part in str(error.value)


def test_a_mark_at_the_start_of_the_file_is_passed_over(tmp_path: Path) -> None:
    path = tmp_path / "job.toml"
    path.write_text('name = "marked"\n' + TWO, encoding="utf-8-sig")
    assert Job.load(path, ARM).name == "marked"


def test_a_name_the_board_cannot_store(tmp_path: Path) -> None:
    path = tmp_path / "job.toml"
    path.write_text('name = "a/b"\n' + TWO)
    with pytest.raises(InputError, match="a-z A-Z 0-9"):
        Job.load(path, ARM)


def test_a_table_as_a_job_is_referred_to_import(tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    path.write_text("0,-60,40\n20,-75,50\n")
    with pytest.raises(InputError) as error:
        Job.load(path, ARM)
    assert "armtempo import" in error.value.hint
