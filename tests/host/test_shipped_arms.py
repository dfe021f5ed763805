"""The arms that ship: their tables against published forward kinematics, their steps against published ones."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from armtempo.basics.errors import InputError
from armtempo.kinematics import Geometry, forward
from armtempo.kinematics.shape import refusals
from armtempo.model import shipped
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.planning import planner
from numpy.typing import NDArray

Array = NDArray[np.float64]
SEED = 20_260_101
NAMES = tuple(shipped.files())
RIGHT = math.pi / 2


def random_postures(arm: Arm, count: int = 50) -> Array:
    """Postures within the ranges, (count, joints) in degrees; joints without a motor too."""
    low, high = np.array([joint.range_deg for joint in arm.joints]).T
    return np.random.default_rng(SEED).uniform(low, high, (count, len(low)))


def tool_poses(arm: Arm, angles_deg: Array) -> Array:
    return forward(Geometry.of(arm), np.radians(angles_deg))


def turned(axis: str, angle: float) -> Array:
    """A (4, 4) rotation about x, y or z."""
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    pose = np.eye(4)
    pose[i, i] = pose[j, j] = math.cos(angle)
    pose[i, j], pose[j, i] = -math.sin(angle), math.sin(angle)
    return pose


def shifted(x: float, y: float, z: float) -> Array:
    pose = np.eye(4)
    pose[:3, 3] = x, y, z
    return pose


def by_urdf(
    origins: list[tuple[tuple[float, float, float], tuple[float, float, float]]], axes: str, q: Array
) -> Array:
    """The tool's pose as URDF defines it: ``origins`` are xyz in mm and rpy, joint i turns about ``axes[i]``.

    An axis in capitals is the negative one, '-' a fixed joint.
    """
    pose, angles = np.eye(4), iter(q)
    for ((xyz, (roll, pitch, yaw))), axis in zip(origins, axes, strict=True):
        pose = pose @ shifted(*xyz) @ turned("z", yaw) @ turned("y", pitch) @ turned("x", roll)
        if axis != "-":
            pose = pose @ turned(axis.lower(), next(angles) * (1 if axis.islower() else -1))
    return pose


STRAIGHT = (0.0, 0.0, 0.0)

# PAROL6-python-API, commit 829c2c7, parol6/urdf_model/urdf/PAROL6.urdf, origins of L1 to L6.
PAROL6 = [
    ((0, 0, 110.5), STRAIGHT),
    ((23.4207210610375, 0, 0), (-RIGHT, 0, 0)),
    ((180, 0, 0), (math.pi, 0, 0)),
    ((-43.5, 176.35, 0), (RIGHT, 0, 0)),
    ((0, 0, 0), (-RIGHT, 0, 0)),
    ((0, 37, 0), (RIGHT, 0, 0)),
]
# Thor-ROS, commit e11a56b, ws_thor/src/thor_urdf/urdf/thor.urdf.xacro, joint_1 to joint_6 and link6_to_gripperbase.
THOR = [((0, 0, z), STRAIGHT) for z in (99, 103, 160, 89.5, 104.5, 13.5, 43)]
# bcn3d_moveo_ros2, commit 71d851b, bcn3d_moveo_description/models/bcn3d_moveo.urdf, Joint_1 to Joint_5; 3.14 read as
# pi, 3.94 as 5 pi / 4, joint 1 the other way round; then the middle of the gripper's gears, its z axis outwards.
MOVEO = [
    ((0, 0, 8), (math.pi, 0, 3 * RIGHT)),
    ((0, 0, -165.5), (0, 0, 2.5 * RIGHT)),
    ((0, -36.75, -221.12), (-math.pi, 0, 0)),
    ((0, -36.75, 127.5), STRAIGHT),
    ((0, 23, 95), (math.pi, 0, 0)),
    ((0, 23, -65), (math.pi, 0, 0)),
]


@pytest.mark.parametrize(
    ("name", "origins", "axes", "within_mm"),
    [("parol6", PAROL6, "zzzzzz", 0.001), ("thor", THOR, "zxxzxz-", 1e-9), ("moveo", MOVEO, "ZYYzy-", 1e-9)],
)
def test_the_table_does_what_the_published_urdf_does(
    name: str, origins: list, axes: str, within_mm: float
) -> None:  # type: ignore[type-arg]
    arm = Arm.load(name)
    angles = random_postures(arm)
    angles[:, [joint.name == "tool" for joint in arm.joints]] = 0.0
    moved = angles[:, : len(axes.strip("-"))]
    found, wanted = tool_poses(arm, angles), [by_urdf(origins, axes, q) for q in np.radians(moved)]
    assert np.max(np.abs(found[:, :3, 3] - np.array(wanted)[:, :3, 3])) < within_mm
    assert np.max(np.abs(found[:, :3, :3] - np.array(wanted)[:, :3, :3])) < 1e-9


def test_ar4_does_what_its_controllers_table_does() -> None:
    """DHparams of the AR4-MK3 sketch: theta, alpha, d, a in the modified convention."""
    table = [
        (0, 0, 169.77, 0),
        (-90, -90, 0, 64.2),
        (0, 0, 0, 305),
        (0, -90, 222.63, 0),
        (0, 90, 0, 0),
        (180, -90, 41, 0),
    ]
    arm = Arm.load("ar4")
    for angles in random_postures(arm):
        pose = np.eye(4)
        for (theta, alpha, d, a), angle in zip(table, angles, strict=True):
            pose = pose @ turned("x", math.radians(alpha)) @ shifted(a, 0, 0)
            pose = pose @ turned("z", math.radians(theta + angle)) @ shifted(0, 0, d)
        np.testing.assert_allclose(tool_poses(arm, angles), pose, atol=1e-9)


def test_the_community_arm_stands_where_its_firmware_says() -> None:
    """config.h: INITIAL_Y 120 + 54 and INITIAL_Z 120 with the lower arm upright and the upper one level; the radius
    and height that robotGeometry.cpp inverts. The hand stays level and rods keep forearm and lower arm apart."""
    arm = Arm.load("community")
    home = tool_poses(arm, np.array([0.0, 0.0, 90.0, 0.0]))
    np.testing.assert_allclose(home, shifted(174, 0, 120), atol=1e-9)
    angles = random_postures(arm)
    angles[:, 3] = 0.0
    turn, low, high, _ = np.radians(angles).T
    radius = 54 + 120 * np.sin(low) + 120 * np.sin(high)
    height = 120 * np.cos(low) + 120 * np.cos(high)
    poses = tool_poses(arm, angles)
    wanted = np.stack([radius * np.cos(turn), radius * np.sin(turn), height], axis=1)
    np.testing.assert_allclose(poses[:, :3, 3], wanted, atol=1e-9)
    np.testing.assert_allclose(poses[:, :3, 2], np.broadcast_to([0.0, 0.0, 1.0], (50, 3)), atol=1e-9)


def test_every_posture_of_the_community_arm_keeps_its_rods_bounds() -> None:
    """SHANKS_MIN_ANGLE_COS and SHANKS_MAX_ANGLE_COS of config.h, and Z_MIN, Z_MAX at the wrist."""
    _, lower, forearm, _ = Arm.load("community").joints
    for low in lower.range_deg:
        for high in forearm.range_deg:
            cosine = math.cos(math.radians(180.0 - (high - low)))
            assert -0.774944489 <= cosine <= 0.791436948
            assert -140 <= 120 * (math.cos(math.radians(low)) + math.cos(math.radians(high))) <= 150


def test_scara_stands_where_its_sketch_says() -> None:
    """xP = L1 cos(theta1) + L2 cos(theta1 + theta2), yP with sines."""
    arm = Arm.load("scara")
    angles = random_postures(arm)
    one, two, three = np.radians(angles).T
    poses = tool_poses(arm, angles)
    np.testing.assert_allclose(poses[:, 0, 3], 228 * np.cos(one) + 136.5 * np.cos(one + two), atol=1e-9)
    np.testing.assert_allclose(poses[:, 1, 3], 228 * np.sin(one) + 136.5 * np.sin(one + two), atol=1e-9)
    np.testing.assert_allclose(poses[:, 0, 0], np.cos(one + two + three), atol=1e-9)


def test_the_screw_lifts_the_scara_and_the_rail_carries_the_community_arm() -> None:
    """Else they are the arms without; zDistanceToSteps = 100."""
    for name, plain, along in (("scara_z", "scara", 2), ("community_rail", "community", 1)):
        arm, still = Arm.load(name), Arm.load(plain)
        assert arm.joints[-len(still.joints) :] == still.joints
        rng = np.random.default_rng(SEED)
        angles = random_postures(still)
        slide = rng.uniform(-100.0, 100.0, len(angles))
        before = np.zeros((len(angles), len(arm.joints) - len(still.joints)))
        before[:, -1] = slide
        wanted = tool_poses(still, angles)
        wanted[:, along, 3] += slide
        np.testing.assert_allclose(tool_poses(arm, np.hstack([before, angles])), wanted, atol=1e-9)
    assert Arm.load("scara_z").driven[0].steps_per_deg == 100


@pytest.mark.parametrize(
    ("name", "steps_per_deg"),
    [
        # MOTOR_STEPS_PER_DEG_MK3
        ("ar4", (88.88888888, 111.11111112, 111.11111112, 99.55555554, 43.72049776, 44.44444444)),
        # 32 * 200 / 360 * _joint_ratio
        ("parol6", [6400 / 360 * ratio for ratio in (6.4, 20, 20 * 38 / 42, 4, 4, 10)]),
        # stepsPerRevolution
        ("moveo", [steps / 360 for steps in (32800, 18000, 72000, 3280, 14400)]),
        # teeth of the CAD files, the planetary gear's 57/11, and the assumed 120 / 20 of joint 3 and belts of the wrist
        (
            "thor",
            [3200 / 360 * ratio for ratio in (50 / 10, 57 / 11 * 60 / 10, 57 / 11 * 120 / 20, 20 / 10, 1, 1)],
        ),
        # STEPS_PER_REV, MICROSTEPS, MAIN_GEAR_TEETH, MOTOR_GEAR_TEETH
        ("community", [200 * 16 * 90 / 20 / 360] * 3),
        # theta1AngleToSteps, theta2AngleToSteps, phiAngleToSteps
        ("scara", (44.444444, 35.555555, 10)),
    ],
)
def test_steps_per_degree_are_the_published_ones(name: str, steps_per_deg: list[float]) -> None:
    driven = Arm.load(name).driven
    np.testing.assert_allclose([joint.motor.steps_per_deg for joint in driven], steps_per_deg, rtol=3e-8)


def test_ar4_encoders_count_as_its_driver_says() -> None:
    """ENC_MULT_MK3: encoder counts a motor step; ENC_DIR."""
    joints = [joint for joint in Arm.load("ar4").driven if joint.encoder]
    assert [float(joint.counts_per_step) for joint in joints] == [5, 5, 5, 5]
    assert [joint.encoder.direction for joint in joints if joint.encoder] == [-1, 1, 1, 1]


@pytest.mark.long
@pytest.mark.parametrize("name", NAMES)
def test_each_says_where_its_figures_are_from_and_can_be_planned_for(name: str) -> None:
    path = shipped.files()[name]
    head = path.read_text(encoding="utf-8").split("name =")[0]
    assert name == shipped.PAPER or ("Source" in head or "Geometry" in head)
    assert name == shipped.PAPER or "assumed" in head.lower()
    arm = Arm.load(name)
    home = np.array([joint.home_deg for joint in arm.driven])
    middle = np.array([np.mean(joint.range_deg) for joint in arm.driven])
    away = home + 0.2 * (middle - home) + 1.0 * (middle == home)
    via = (tuple(home), tuple((home + away) / 2), tuple(away), tuple(home))
    plan = planner.plan(arm, Job(name="there", via=via, population=4, iterations=4, path="through"))
    assert plan.trajectory.duration_s > 0


def test_a_file_wins_over_a_name_and_a_folder_does_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert shipped.find("ar4") == shipped.ArmFile(shipped.files()["ar4"], True)
    Path("ar4").mkdir()
    assert shipped.find("ar4").ships
    Path("ar4").rmdir()
    Path("ar4").write_text(shipped.files()["scara"].read_text())
    assert shipped.find("ar4") == shipped.ArmFile(Path("ar4"), False)
    assert Arm.load("ar4").name == Arm.load("scara").name
    assert len(Arm.paper().joints) == 6


def test_an_unknown_name_names_those_there_are() -> None:
    for look_up in (shipped.find, Arm.load):
        with pytest.raises(
            InputError, match="paper, ar4, community, community_rail, moveo, parol6, scara, scara_z, thor"
        ):
            look_up("ar5")


def test_the_page_on_arms_lists_them_all() -> None:
    page = (Path(__file__).parents[2] / "host" / "docs" / "arms.md").read_text(encoding="utf-8")
    listed = [line.split("`")[1] for line in page.splitlines() if line.startswith("| `")]
    assert listed == [
        shipped.PAPER,
        "ar4",
        "parol6",
        "thor",
        "moveo",
        "community",
        "community_rail",
        "scara",
        "scara_z",
    ]
    assert sorted(listed) == sorted(NAMES)
    for name in NAMES:
        row = next(line for line in page.splitlines() if line.startswith(f"| `{name}`"))
        arm = Arm.load(name)
        assert f"| {len(arm.driven)}" in row
        assert ("closed form" in row) == (not refusals(Geometry.of(arm)))
