"""Arm and job files: the shipped ones, and the message for everything that can be wrong in one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from armtempo.basics.errors import InputError
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.tool_pose import Pose

from tests.host.arms import changed


def test_the_shipped_arm_is_the_papers() -> None:
    arm = Arm.paper()
    assert [joint.d_mm * 5 for joint in arm.joints] == [650, 0, 0, 1800, 0, 200]  # Table 1
    assert [joint.a_mm * 5 for joint in arm.joints] == [-500, 1500, 600, 0, 0, 0]
    assert [joint.alpha_deg for joint in arm.joints] == [-90, 0, -90, 90, -90, 0]
    limits = [joint.limits for joint in arm.driven]
    assert [(x.speed_deg_s, x.acceleration_deg_s2, x.jerk_deg_s3) for x in limits if x] == [
        (50, 50, 150),
        (40, 30, 120),
        (60, 40, 150),
    ]  # Table 5
    motors = [joint.motor for joint in arm.driven]
    per_step = [360 / (m.steps_per_rev * m.microsteps) for m in motors if m]
    assert per_step == [0.05625, 0.225, 0.05625]  # Table 7
    assert [m.gear_ratio for m in motors if m] == [2, 20, 2]
    assert [joint.encoder.counts_per_rev for joint in arm.driven if joint.encoder] == [4000] * 3


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "speed_deg_s = 50.0",
            "speed_deg_s = -50.0",
            ["joint[1].limits.speed_deg_s = -50.0", "at least 0.001"],
        ),
        ("speed_deg_s = 50.0", "speed_deg_s = nan", ["joint[1].limits.speed_deg_s = nan", "a number"]),
        ("speed_deg_s = 50.0", 'speed_deg_s = "50"', ["speed_deg_s = '50'", "a number"]),
        ("speed_deg_s = 50.0, ", "", ["joint[1].limits.speed_deg_s is missing"]),
        (
            "microsteps = 8",
            "microsteps = 8.5",
            ["joint[2].motor.microsteps = 8.5", "whole number from 1 to 256"],
        ),
        ("gear_ratio = 20.0", "gear_ratio = 1e-308", ["joint[2].motor.gear_ratio = 1e-308", "at least 0.1"]),
        ("gear_ratio = 20.0", "gear_ratio = 1e5", ["joint[2].motor.gear_ratio = 100000.0", "at most 10000"]),
        (
            "jerk_deg_s3 = 150.0",
            "jerk_deg_s3 = 1e-9",
            ["joint[1].limits.jerk_deg_s3 = 1e-09", "at least 0.001"],
        ),
        ("speed_deg_s = 50.0", "speed_deg_s = 1e9", ["speed_deg_s = 1000000000.0", "at most 100000"]),
        ("-10.0, 190.0", "-1e6, 190.0", ["joint[1].range_deg", "at most 36000 either way"]),
        ("holding_torque_nm = 0.65", "holding_torque_nm = -1", ["holding_torque_nm = -1", "at least 0"]),
        ("backlash_deg = 0.05", "backlash_deg = 500", ["backlash_deg = 500", "at most 90"]),
        ("home_deg = 0.0", 'type = "prismatic"', ["joint[1].range_deg is of a turning joint", "range_mm"]),
        ("home_deg = 0.0", "fixed_deg = 5", ["joint[1].motor", "leave it out: fixed_deg locks the joint"]),
        ("home_deg = 0.0", "dynamics = { mass_kg = 1, centre_mm = [0, 0, 1e300] }", ["from -1e+06 to 1e+06"]),
        (
            "home_deg = 0.0",
            "dynamics = { mass_kg = 0, inertia_kg_m2 = [1e300, 0, 0, 0, 0, 0] }",
            ["from -10000 to 10000"],
        ),
        (
            "motor = { channel = 3",
            "# motor = { channel = 3",
            ["joint[3].encoder = ", "give the joint a motor"],
        ),
        ("home_deg = 0.0", "parallel_linkage = true", ["joint[1].parallel_linkage", "no joint before it"]),
        ("microsteps = 8", "microstep = 8", ["joint[2].motor.microsteps is missing"]),
        ("gear_ratio = 20.0", "gear_ratio = 20.0, wheels = 3", ["joint[2].motor.wheels: unknown key"]),
        ("a_mm = ", "a_mm = 1e300 # ", ["joint[1].a_mm = 1e+300", "of at most 1e+06"]),
        ("home_deg = 40.0", "home_def = 40.0", ["joint[3].home_def: unknown key", "'home_deg'"]),
        ("home_deg = 40.0", "home_deg = 400.0", ["joint[3].home_deg = 400.0", "at most 100"]),
        ("range_deg = [-10.0, 190.0]", "range_deg = [190.0, -10.0]", ["joint[1].range_deg", "smaller first"]),
        ("range_deg = [-10.0, 190.0]", "range_deg = [190.0]", ["joint[1].range_deg", "list of 2 numbers"]),
        ('enable_active = "low"', 'enable_active = "off"', ["driver.enable_active = 'off'", "'low', 'high'"]),
        ("estop_fitted = false", "estop_fitted = 0", ["safety.estop_fitted = 0", "True, False"]),
        (
            "motor = { channel = 2,",
            "motor = { channel = 1,",
            ["motor.channel = 1 is used by joint 1 and joint 2"],
        ),
        ('on = "joint"', 'on = "belt"', ["joint[1].encoder.on = 'belt'", "'joint', 'motor'"]),
        ('name = "paper-1to5"', 'name = ""', ["name = ''", "not empty"]),
        ('name = "paper-1to5"', 'name = "x', ["not valid TOML", "line"]),
        ("home_deg = 0.0", 'switches = { low = "PF1" }', ["switches.low = 'PF1'", "a free pin such as PD0"]),
        ("home_deg = 0.0", 'switches = { low = "PE7" }', ["joint 1: PE7", "DIR of channel 1"]),
        (
            "home_deg = 0.0",
            'switches = { low = "PD0", high = "PD0" }',
            ["PD0 is the pin of switches of joint 1"],
        ),
        ("[driver]", 'homing = ["joint 9"]\n[driver]', ["homing = ['joint 9']", "the joints are joint 1"]),
        ("[driver]", 'homing = [["joint 1"], "joint 1"]\n[driver]', ["homing", "each once"]),
        ("[driver]", "homing = [[]]\n[driver]", ["homing", "a list of joints' names"]),
        ("[driver]", "[drivers]", ["drivers: unknown key", "did you mean 'driver'"]),
    ],
)
def test_what_is_wrong_is_said_with_file_key_and_value(
    tmp_path: Path, old: str, new: str, said: list[str]
) -> None:
    path = changed(tmp_path, (old, new))
    with pytest.raises(InputError) as error:
        Arm.load(path)
    for text in [str(path), *said]:
        assert text in str(error.value)


def test_a_missing_file_and_an_empty_one(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="neither a file"):
        Arm.load(tmp_path / "none.toml")
    empty = tmp_path / "empty.toml"
    empty.touch()
    with pytest.raises(InputError, match="name is missing"):
        Arm.load(empty)


def test_a_drive_without_limits_and_an_arm_without_drives(tmp_path: Path) -> None:
    limits = "limits = { speed_deg_s = 60.0, acceleration_deg_s2 = 40.0, jerk_deg_s3 = 150.0 }\n"
    with pytest.raises(InputError, match=r"joint\[3\]\.limits is missing"):
        Arm.load(changed(tmp_path, (limits, "")))
    path = tmp_path / "still.toml"
    path.write_text('name = "x"\n[[joint]]\nd_mm = 0\na_mm = 0\nalpha_deg = 0\nrange_deg = [0, 1]\n')
    with pytest.raises(InputError, match="no joint has a motor"):
        Arm.load(path)


# job files: the shipped one, and the message for everything that can be wrong in one


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
        (TWO + "[[via]]\nangles_deg = [0, -60, 40]\n", ["not allowed here", "both give the via points"]),
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
