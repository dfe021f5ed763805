"""Arm files: the shipped one, and the message for everything that can be wrong in one."""

from __future__ import annotations

from pathlib import Path

import pytest
from armtempo.basics.errors import InputError
from armtempo.model import shipped
from armtempo.model.arm import Arm


def changed(tmp_path: Path, old: str, new: str) -> Path:
    """The shipped arm file with one text replaced."""
    text = shipped.arm_path().read_text()
    assert old in text
    path = tmp_path / "arm.toml"
    path.write_text(text.replace(old, new, 1))
    return path


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
        ("home_deg = 0.0", 'type = "prismatic"', ["joint[1].type", "sliding ones are not supported"]),
        ("home_deg = 0.0", "fixed_deg = 5", ["joint[1].motor", "left out if fixed_deg locks the joint"]),
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
    path = changed(tmp_path, old, new)
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
        Arm.load(changed(tmp_path, limits, ""))
    path = tmp_path / "still.toml"
    path.write_text('name = "x"\n[[joint]]\nd_mm = 0\na_mm = 0\nalpha_deg = 0\nrange_deg = [0, 1]\n')
    with pytest.raises(InputError, match="no joint has a motor"):
        Arm.load(path)
