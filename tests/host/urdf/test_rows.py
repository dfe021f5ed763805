"""URDF in: rows of every kind of chain against a forward kinematics of the tests' own."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
import trimesh
from armtempo.cli import main
from armtempo.kinematics import Geometry, all_frames, forward, of_arm
from armtempo.kinematics.chain import outline_mm
from armtempo.kinematics.dynamics import joint_torques
from armtempo.kinematics.shape import refusals
from armtempo.model import mesh_files
from armtempo.model.arm import Arm
from armtempo.model.joint_unit import is_range_doubtful
from armtempo.new_arm import urdf_reader as reader
from armtempo.new_arm import urdf_rows as dh
from armtempo.planning.capsules import point_distance
from click.testing import CliRunner
from scipy.spatial.transform import Rotation

from tests.host.arms import run_check
from tests.host.urdf.files import FOLDER, J2_LIMIT, Array, about, imported, tool_pose

pytestmark = pytest.mark.slow
SEED = 20_260_102


@pytest.mark.parametrize(
    ("name", "joints"),
    [
        ("three_planar", "j1 j2 j3"),
        ("four_skew", "base j1 j2 j3 j4 tool"),
        ("six_rounded", "j1 j2 j3 j4 j5 j6"),
        ("seven_intersecting", "j1 j2 j3 j4 j5 j6 j7"),
    ],
)
def test_the_written_arm_stands_where_the_urdf_does(tmp_path: Path, name: str, joints: str) -> None:
    """With constant rows only if base or tool need them."""
    out, said = imported(tmp_path, name)
    assert "worst error at 100 random postures" in said
    arm = Arm.read(out)
    assert [joint.name for joint in arm.joints] == joints.split()
    rng = np.random.default_rng(SEED)
    angles = np.array([0.0 if joint.name in ("base", "tool") else rng.uniform(-3, 3) for joint in arm.joints])
    moved = {joint.name: angle for joint, angle in zip(arm.joints, angles, strict=True)}
    wanted = tool_pose(FOLDER / f"{name}.urdf", moved)
    found = forward(Geometry.of(arm), angles)
    np.testing.assert_allclose(found[:3, 3], wanted[:3, 3], atol=0.02)
    np.testing.assert_allclose(found[:3, :3], wanted[:3, :3], atol=2e-4)


def test_the_links_shapes_move_with_their_rows(tmp_path: Path) -> None:
    """A box of the last link and a mesh of the base, wherever the arm is."""
    visual = '<visual><origin xyz="0.01 0.02 0.03" rpy="0 0 0"/><geometry>{}</geometry></visual></link>'
    text = (FOLDER / "four_skew.urdf").read_text()
    box = visual.format('<box size="0.02 0.04 0.06"/>')
    urdf, out = tmp_path / "shapes.urdf", tmp_path / "arm.toml"
    text = text.replace('<link name="tool"/>', f'<link name="tool">{box}')
    foot = visual.format('<mesh filename="{}" scale="2 2 2"/>')
    text = text.replace('<link name="world"/>', f'<link name="world">{foot}')
    trimesh.creation.box((1.0, 1.0, 1.0)).export(tmp_path / "foot.stl")
    command = ["import-urdf", str(urdf), "-o", str(out), "--meshes"]
    urdf.write_text(text.format("gone.stl"))
    assert "mesh 'gone.stl' cannot be read" in CliRunner().invoke(main, command).output
    assert not out.exists()
    urdf.write_text(text.format("package://arm/foot.stl"))
    done = CliRunner().invoke(main, command)
    assert "wrote 2 meshes" in done.output
    assert "1 of 6 rows have a radius_mm" in done.output
    assert "already exists" in CliRunner().invoke(main, command).output
    mine = tmp_path / "arm-meshes" / "mine.stl"
    mine.write_text("not of this arm")
    CliRunner().invoke(main, [*command, "--force"])
    assert mine.read_text() == "not of this arm"
    arm = Arm.read(out)
    files = mesh_files.of_arm(arm)
    last = max(number for number, joint in enumerate(arm.joints, 1) if joint.name == "j4")
    assert sorted(files) == [0, last]
    rng = np.random.default_rng(SEED)
    angles = np.array([0.0 if joint.name in ("base", "tool") else rng.uniform(-3, 3) for joint in arm.joints])
    frame = all_frames(Geometry.of(arm), angles.tolist())[last]
    tool = tool_pose(urdf, {joint.name: angle for joint, angle in zip(arm.joints, angles, strict=True)})
    found = mesh_files.read(files[last]) @ frame[:3, :3].T + frame[:3, 3]
    at_tool = (found - tool[:3, 3]) @ tool[:3, :3]
    np.testing.assert_allclose(
        np.abs(at_tool - (10, 20, 30)).reshape(-1, 3), np.tile((10, 20, 30), (36, 1)), atol=0.1
    )
    np.testing.assert_allclose(mesh_files.read(files[0]).max(axis=(0, 1)), (1010, 1020, 1030), atol=1e-3)


def test_capsules_of_rows_contain_the_shapes_for_collision(tmp_path: Path) -> None:
    """A tilted tin on each link, of the last one within the tool's row; wherever the arm is."""
    urdf, out = tmp_path / "thick.urdf", tmp_path / "arm.toml"
    shape = '<{0}><origin xyz="0.01 0.02 0.03" rpy="0.3 0.2 0"/><geometry>{1}</geometry></{0}>'.format
    tin = shape("collision", '<cylinder radius="0.02" length="0.1"/>')
    seen = shape("visual", '<box size="9 9 9"/>')
    plain = (FOLDER / "four_skew.urdf").read_text()
    text = re.sub(r'<link name="(l\d|tool)"/>', rf'<link name="\1">{seen}{tin}</link>', plain)
    urdf.write_text(text)
    done = CliRunner().invoke(main, ["import-urdf", str(urdf), "-o", str(out)])
    assert "5 of 6 rows have a radius_mm" in done.output, done.output
    arm = Arm.read(out)
    rng = np.random.default_rng(SEED)
    angles = np.array([0.0 if joint.name in ("base", "tool") else rng.uniform(-3, 3) for joint in arm.joints])
    moved = {joint.name: angle for joint, angle in zip(arm.joints, angles, strict=True)}
    points = outline_mm(arm, np.degrees(angles))
    turn = Rotation.from_euler("xyz", [0.3, 0.2, 0.0]).as_matrix()
    tin_mm = 1e3 * trimesh.creation.cylinder(0.02, 0.1).vertices @ turn.T + (10, 20, 30)
    for number, link in enumerate(("l1", "l2", "l3", "l4"), 1):
        pose = tool_pose(urdf, moved, link)
        at = tin_mm @ pose[:3, :3].T + pose[:3, 3]
        rows = [number, number + 1] if link == "l4" else [number]
        least = np.min(
            [
                point_distance(at, points[None, part], (points[part + 1] - points[part])[None])
                - arm.joints[row].radius_mm
                for row in rows
                for part in (2 * row, 2 * row + 1)
            ],
            axis=0,
        )
        assert (-0.3 if link != "l4" else -99.0) < least.max() < 0.01, link
    urdf.write_text(text.replace('<cylinder radius="0.02" length="0.1"/>', '<mesh filename="gone.stl"/>'))
    done = CliRunner().invoke(main, ["import-urdf", str(urdf), "-o", str(out), "--force"])
    assert "0 of 6 rows have a radius_mm" in done.output
    assert "# No link has a radius_mm, as not all shapes are known" in out.read_text()


def test_ranges_are_the_urdfs_and_never_wider(tmp_path: Path) -> None:
    arm = Arm.read(imported(tmp_path, "four_skew")[0])
    ranges = {joint.name: joint.range_deg for joint in arm.joints}
    assert ranges["j1"] == (-114.5915, 114.5915)  # 2 rad are 114.59156 degrees
    assert ranges["j4"] == reader.CONTINUOUS_DEG
    assert ranges["base"] == ranges["tool"] == (-0.001, 0.001)
    assert next(joint.home_deg for joint in arm.joints if joint.name == "j3") == 71.6  # 0 is not in its range


@pytest.mark.parametrize(
    ("soft", "range_deg", "said"),
    [
        ("soft_lower_limit='-1.5' soft_upper_limit='1.75' k_velocity='1'", (-85.943, 100.267), "-85.944 to 100.27"),
        ("soft_lower_limit='-3' soft_upper_limit='1'", (-114.591, 57.295), "-114.59 to 57.296"),
        ("soft_lower_limit='-3' soft_upper_limit='3'", (-114.591, 114.591), ""),
        ("k_velocity='1'", (-114.591, 114.591), ""),
        ("soft_lower_limit='2.5' soft_upper_limit='3'", (-114.591, 114.591), "2.5 to 3, leave it no range"),
        ("soft_lower_limit='1' soft_upper_limit='-1'", (-114.591, 114.591), "1 to -1, leave it no range"),
    ],
)  # fmt: skip
def test_soft_limits_narrow_a_range(
    tmp_path: Path, soft: str, range_deg: tuple[float, float], said: str
) -> None:
    urdf, out = tmp_path / "soft.urdf", tmp_path / "arm.toml"
    text = (FOLDER / "three_planar.urdf").read_text()
    urdf.write_text(text.replace(J2_LIMIT, f"{J2_LIMIT}<safety_controller {soft}/>"))
    told = CliRunner().invoke(main, ["import-urdf", str(urdf), "-o", str(out)]).output
    assert said in told
    assert ("safety_controller" in told) == bool(said)
    assert ("by the soft limits" in out.read_text()) == ("leave it" not in said and bool(said))
    assert Arm.shape(out).joints[1].range_deg == pytest.approx(range_deg, abs=2e-3)


def test_quarter_turns_with_few_digits_become_quarter_turns(tmp_path: Path) -> None:
    """So that the closed-form inverse serves the arm."""
    arm = Arm.read(imported(tmp_path, "six_rounded")[0])
    assert [abs(joint.alpha_deg) for joint in arm.joints] == [90, 180, 90, 90, 90, 180]
    assert [joint.d_mm for joint in arm.joints] == [170, 0, 0, -260, 0, 40]
    assert [joint.a_mm for joint in arm.joints] == [50, 300, 20.1, 0, 0, 0]
    assert refusals(Geometry.of(arm)) == []


def test_motors_are_left_to_fill_in_and_check_says_so(tmp_path: Path) -> None:
    out, said = imported(tmp_path, "six_rounded")
    assert f"armtempo check --arm {out}" in said
    result = CliRunner().invoke(main, ["check", "--arm", str(out)])
    assert result.exit_code == 1
    assert "no joint has a motor" in result.output
    text = out.read_text()
    for mark in ("# limits", "# motor", "# encoder"):
        text = text.replace(mark, mark[2:])
    out.write_text(text)
    assert next(joint.limits.speed_deg_s for joint in Arm.read(out).driven if joint.limits) == 114.592
    result = CliRunner().invoke(main, ["check", "--arm", str(out)])
    assert "no motor" not in result.output


def test_a_seventh_joint_gets_no_channel(tmp_path: Path) -> None:
    text = imported(tmp_path, "seven_intersecting")[0].read_text()
    assert "channel = 6" in text
    assert "channel = 7" not in text
    assert "The board drives 6 joints" in text


def test_the_tip_chooses_the_chain(tmp_path: Path) -> None:
    out, said = imported(tmp_path, "gripper", "--tip", "hand")
    assert "3 joints from link 'base' to 'hand'" in said
    out.unlink()
    _, said = imported(tmp_path, "gripper")
    assert "3 joints from link 'base' to 'hand'" in said  # the fingers follow there
    out.unlink()
    _, said = imported(tmp_path, "gripper", "--base", "l1", "--tip", "left_finger")
    assert "3 joints from link 'l1' to 'left_finger'" in said


def test_limits_in_degrees_are_suspected_at_import_and_by_check(tmp_path: Path) -> None:
    text = (FOLDER / "three_planar.urdf").read_text()
    urdf, out = tmp_path / "degrees.urdf", tmp_path / "arm.toml"
    limit = J2_LIMIT.replace("2.0", "90").replace("1.5", "180")
    urdf.write_text(text.replace(J2_LIMIT, limit))
    result = CliRunner().invoke(main, ["import-urdf", str(urdf), "-o", str(out)])
    assert result.exit_code == 0, result.output
    assert (
        "joint 'j2': its limits, -90 to 90 rad, are -5156.6 to 5156.6 degrees: are they in degrees?"
        in result.output
    )
    assert "joint 'j2': its speed, 180 rad/s, is 10313 degrees/s: is it in degrees/s?" in result.output
    checked = run_check("--arm", out)
    assert "were degrees taken as radians?" in checked.output
    assert "if so, write range_deg = [-90, 90]" in checked.output


@pytest.mark.parametrize(
    ("limits", "is_doubtful"),
    [((-10, 10), True), ((0, 12), True), ((-6, 6), False), ((0, 6.283), False), ((-6.2832, 6.2832), False),
     ((-9.4248, 9.4248), False), ((-12.5, 13.5), True)],
)  # fmt: skip
def test_whole_radians_beyond_a_turn_are_doubtful(limits: tuple[float, float], is_doubtful: bool) -> None:
    low, high = map(math.degrees, limits)
    for decimals in (12, 4, 1):
        assert is_range_doubtful((round(low, decimals), round(high, decimals))) == is_doubtful


@pytest.mark.parametrize(("low", "high"), [(0.1, 0.4), (-0.3, 0.2)])
def test_capsules_of_a_slide_contain_its_shapes_wherever_it_is(
    tmp_path: Path, low: float, high: float
) -> None:
    urdf, out = tmp_path / "slide.urdf", tmp_path / "arm.toml"
    text = (FOLDER / "three_planar.urdf").read_text().replace('name="j2" type="rev', 'name="j2" type="pris')
    text = text.replace('type="prisolute"', 'type="prismatic"')
    text = text.replace(J2_LIMIT, J2_LIMIT.replace("-2.0", str(low)).replace('"2.0"', f'"{high}"'))
    box = '<visual><origin xyz="0.05 0 0.02" rpy="0 0 0"/><geometry><box size="0.1 0.04 0.2"/></geometry></visual>'
    urdf.write_text(text.replace('<link name="l2"/>', f'<link name="l2">{box}</link>'))
    done = CliRunner().invoke(main, ["import-urdf", str(urdf), "-o", str(out)])
    assert done.exit_code == 0, done.output
    arm = Arm.read(out)
    row = [joint.name for joint in arm.joints].index("j2")
    assert arm.joints[row].radius_mm > 0.0
    corners = 1e3 * trimesh.creation.box((0.1, 0.04, 0.2)).vertices + (50, 0, 20)
    for at in np.linspace(low, high, 5):
        pose = tool_pose(urdf, {"j1": 0.0, "j2": float(at), "j3": 0.0}, "l2")
        seen = corners @ pose[:3, :3].T + pose[:3, 3]
        points = outline_mm(arm, [1e3 * at if joint.slides else 0.0 for joint in arm.joints])
        away = [
            point_distance(seen, points[None, part], (points[part + 1] - points[part])[None])
            for part in (2 * row, 2 * row + 1)
        ]
        assert np.min(away, axis=0).max() <= arm.joints[row].radius_mm + 1e-6


def test_places_in_mm_and_directions_in_degrees_are_suspected(tmp_path: Path) -> None:
    text = (FOLDER / "three_planar.urdf").read_text()
    urdf = tmp_path / "units.urdf"
    urdf.write_text(text.replace('xyz="0.25 0 0.02" rpy="0 0 0"', 'xyz="250 0 20" rpy="0 90 0"'))
    result = CliRunner().invoke(main, ["import-urdf", str(urdf), "-o", str(tmp_path / "arm.toml")])
    assert result.exit_code == 0, result.output
    said = " ".join(result.output.split())
    assert "its xyz, 250 0 20: is it in mm? A URDF has metres; correct it there" in said
    assert "its rpy, 0 90 0: is it in degrees? A URDF has radians; correct it there" in said


def test_a_new_project_says_what_is_doubtful_in_a_urdf(tmp_path: Path) -> None:
    urdf = tmp_path / "robot.urdf"
    text = (FOLDER / "three_planar.urdf").read_text()
    urdf.write_text(text.replace(J2_LIMIT, J2_LIMIT.replace("2.0", "90")))
    done = CliRunner().invoke(main, ["new", str(tmp_path / "x"), "--urdf", str(urdf)])
    assert done.exit_code == 0, done.output
    assert "note: joint 'j2': its limits, -90 to 90 rad" in done.output
    assert "correct it, or the joint in arm.toml" in done.output


def test_names_of_any_kind_are_written_safely_and_blank_ones_replaced(tmp_path: Path) -> None:
    path, out = tmp_path / "robot.urdf", tmp_path / "arm.toml"
    text = (FOLDER / "three_planar.urdf").read_text().replace('"three planar"', '" "')
    text = text.replace('name="j1"', 'name="j &quot;1&quot;&#10;d_mm = 7 # \\ é"')
    path.write_text(text.replace('name="j2"', 'name=" "'))
    result = CliRunner().invoke(main, ["import-urdf", str(path), "-o", str(out)])
    assert result.exit_code == 0, result.output
    arm = Arm.read(out)
    assert (arm.name, arm.joints[1].name, arm.joints[2].name) == ("imported arm", "joint 2", "j3")
    assert arm.joints[0].name.startswith('j "1"')


def random_turn(rng: np.random.Generator) -> Array:
    """A turn of any kind: none, quarter turns about an axis, or any."""
    kind = rng.integers(0, 3)
    if kind == 0:
        return np.eye(4)
    if kind == 1:
        return about(np.eye(3)[rng.integers(0, 3)], rng.integers(0, 4) * math.pi / 2)
    return about(rng.normal(size=3), rng.uniform(-3, 3))


def test_rows_of_300_random_chains() -> None:
    """Parallel, meeting, collinear and skew axes, any base and tool: at most two rows more than joints."""
    rng = np.random.default_rng(SEED)
    for _ in range(300):
        moves = []
        for _ in range(int(rng.integers(2, 9))):
            move = random_turn(rng)
            move[:3, 3] = rng.uniform(-300, 300, 3) * rng.integers(0, 2, 3)
            moves.append(move)
        frames = [np.eye(4)]
        for move in moves:
            frames.append(frames[-1] @ move)
        axes = [dh.AxisLine(frame[:3, 3], frame[:3, 2]) for frame in frames[1:-1]]
        table = dh.derive(axes, frames[-1], dh.Near(1e-9, 1e-7))
        assert len(axes) <= len(table) <= len(axes) + 2
        angles = rng.uniform(-3, 3, len(axes))
        wanted = moves[0]
        for angle, move in zip(angles, moves[1:], strict=True):
            wanted = wanted @ about(np.array([0.0, 0.0, 1.0]), angle) @ move
        moved = [0.0 if row.joint is None else angles[row.joint] for row in table]
        np.testing.assert_allclose(forward(dh.geometry(table), moved), wanted, atol=1e-8)


@pytest.mark.parametrize("name", ["four_skew", "six_rounded"])
def test_a_tools_mass_weighs_on_the_joints_as_in_the_urdf(tmp_path: Path, name: str) -> None:
    """Torque at rest is the slope of the mass's height; four_skew has constant rows at base and tool."""
    path, out = tmp_path / "robot.urdf", tmp_path / "arm.toml"
    centre, inertia = np.array([0.03, -0.02, 0.05]), 'ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"'
    inertial = f'<inertial><origin xyz="0.03 -0.02 0.05"/><mass value="0.8"/><inertia {inertia}/></inertial>'
    text = (FOLDER / f"{name}.urdf").read_text()
    path.write_text(text.replace('<link name="tool"/>', f'<link name="tool">{inertial}</link>'))
    assert CliRunner().invoke(main, ["import-urdf", str(path), "-o", str(out)]).exit_code == 0
    arm = Arm.read(out)
    assert sum(joint.dynamics.mass_kg for joint in arm.joints if joint.dynamics) == 0.8
    turning = [number for number, joint in enumerate(arm.joints) if joint.name not in ("base", "tool")]
    angles = np.zeros(len(arm.joints))
    angles[turning] = np.random.default_rng(SEED).uniform(-1, 1, len(turning))

    def height(changed: Array) -> float:
        pose = tool_pose(path, {joint.name: angle for joint, angle in zip(arm.joints, changed, strict=True)})
        return float(pose[2, 3] / 1000 + pose[2, :3] @ centre)

    step = 1e-5 * np.eye(len(angles))[turning]
    wanted = [0.8 * 9.80665 * (height(angles + each) - height(angles - each)) / 2e-5 for each in step]
    still = np.zeros((1, len(angles)))
    found = joint_torques(arm, angles[None], still, still)[0, turning]
    np.testing.assert_allclose(found, wanted, atol=2e-4)


@pytest.mark.parametrize(("name", "joints"), [("six_rounded", 6), ("seven_intersecting", 7)])
def test_an_imported_arm_has_kinematics_before_its_motors(tmp_path: Path, name: str, joints: int) -> None:
    out, said = imported(tmp_path, name)
    assert ("lock some of them by fixed_deg" in said) == (joints == 7)
    angles_deg = np.linspace(10.0, 25.0, joints)
    pose = of_arm.forward(out, np.resize(angles_deg, len(Arm.read(out).joints)) * turns(out))
    assert any(
        np.allclose(of_arm.forward(out, found.angles_deg), pose, atol=0.1)
        for found in of_arm.inverse(out, pose)
    )
    for command in ("fk", "ik"):
        where = [] if command == "fk" else ["--position", *map(str, pose[:3, 3])]
        result = CliRunner().invoke(main, [command, "--arm", str(out), *where])
        assert result.exit_code == 0, result.output


def turns(path: Path) -> Array:
    """1 for each joint that turns, 0 for a constant row."""
    return np.array([float(np.ptp(joint.range_deg) > 1) for joint in Arm.read(path).joints])


def test_a_joint_is_locked(tmp_path: Path) -> None:
    out, _ = imported(tmp_path, "seven_intersecting")
    text = out.read_text()
    parts = text.split("[[joint]]")
    parts[3] = re.sub("home_deg = .*", "fixed_deg = 20.0", parts[3])
    out.write_text("[[joint]]".join(parts))
    locked = Arm.read(out).joints[2]
    assert (locked.home_deg, locked.motor) == (20.0, None)
    assert np.ptp(locked.range_deg) < 0.01
