"""Joints of a URDF that others turn: mimics, fingers and transmissions."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from armtempo.cli import main
from armtempo.kinematics import of_arm
from armtempo.model.arm import Arm
from click.testing import CliRunner

from tests.host.urdf.files import FOLDER, J2_LIMIT, J3_LIMIT, tool_pose

pytestmark = pytest.mark.slow
SEED = 20_260_102
MIMIC = '<mimic joint="{}" multiplier="{}" offset="{}"/>'


@pytest.mark.parametrize(("limit", "master", "offset"), [(J2_LIMIT, "j1", 0.0), (J3_LIMIT, "j2", 0.3)])
def test_a_joint_that_a_parallelogram_turns(tmp_path: Path, limit: str, master: str, offset: float) -> None:
    """It turns by minus the angle of the joint before, has no motor, and its link keeps its direction."""
    urdf, out = tmp_path / "linkage.urdf", tmp_path / "arm.toml"
    text = (FOLDER / "three_planar.urdf").read_text()
    urdf.write_text(text.replace(limit, MIMIC.format(master, -1, offset)))
    result = CliRunner().invoke(main, ["import-urdf", str(urdf), "-o", str(out)])
    assert result.exit_code == 0, result.output
    content = out.read_text()
    assert [content.count(f"# motor = {{ channel = {channel}") for channel in (1, 2, 3)] == [1, 1, 0]
    arm = Arm.shape(out)
    slave = "j2" if master == "j1" else "j3"
    assert [joint.name for joint in arm.joints if joint.parallel_linkage] == [slave]
    assert slave not in [joint.name for joint in arm.driven]
    rng = np.random.default_rng(SEED)
    for driven in rng.uniform(-2.0, 2.0, (20, 2)):
        angles = dict(zip((joint.name for joint in arm.driven), driven, strict=True))
        angles[slave] = offset - angles[master]
        pose = of_arm.forward(arm, np.degrees(driven))
        np.testing.assert_allclose(pose, tool_pose(urdf, angles), atol=0.02)


def test_the_limits_of_a_linked_joint_narrow_the_range_of_its_master(tmp_path: Path) -> None:
    """It is at 0.3 rad minus the angle of j2, which may turn to 2 rad."""
    urdf, out = tmp_path / "linkage.urdf", tmp_path / "arm.toml"
    text = (FOLDER / "three_planar.urdf").read_text()
    limit = J3_LIMIT.replace("-3.0", "-0.5").replace("3.0", "0.6")
    urdf.write_text(text.replace(J3_LIMIT, limit + MIMIC.format("j2", -1, 0.3)))
    said = CliRunner().invoke(main, ["import-urdf", str(urdf), "-o", str(out)]).output
    assert "joint 'j2': its range is -17.189 to 45.837 degrees, by the limits of 'j3'" in said
    low, high = Arm.shape(out).joints[1].range_deg
    assert (low, high) == pytest.approx(np.degrees((-0.3, 0.8)), abs=1e-3)
    urdf.write_text(text.replace(J3_LIMIT, J3_LIMIT.replace("-3.0", "2.9") + MIMIC.format("j2", -1, 0.3)))
    refused = CliRunner().invoke(main, ["import-urdf", str(urdf), "-o", str(tmp_path / "none.toml")])
    assert refused.exit_code == 2
    assert "the limits of 'j3', which mimics 'j2', leave that no range" in refused.output


@pytest.mark.parametrize(("master", "factor"), [("j1", -1), ("j2", 1), ("j2", -0.5)])
def test_other_linkages_are_refused(tmp_path: Path, master: str, factor: float) -> None:
    urdf = tmp_path / "linkage.urdf"
    text = (FOLDER / "three_planar.urdf").read_text()
    urdf.write_text(text.replace(J3_LIMIT, MIMIC.format(master, factor, 0)))
    result = CliRunner().invoke(main, ["import-urdf", str(urdf), "-o", str(tmp_path / "arm.toml")])
    assert result.exit_code == 2
    assert (
        f"joint 'j3': it mimics '{master}' by a factor of {factor:g}; an arm file has only linkages"
        in result.output
    )
    assert not (tmp_path / "arm.toml").exists()


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (J2_LIMIT, J2_LIMIT + MIMIC.format("j1", 1, 0), "joint 'j2': it mimics 'j1'"),
        (J2_LIMIT, J2_LIMIT + MIMIC.format("j3", -1, 0), "joint 'j2': it mimics 'j3'"),
        (J2_LIMIT, J2_LIMIT + MIMIC.format("j2", -1, 0), "joint 'j2' mimics itself"),
        (J2_LIMIT, J2_LIMIT + MIMIC.format("j9", -1, 0), "mimics 'j9', which this robot does not have"),
        (
            'name="j2" type="revolute">',
            'name="j2" type="prismatic">' + MIMIC.format("j1", -1, 0),
            "joint 'j2': it mimics 'j1', and one of them slides",
        ),
    ],
)
def test_joints_of_the_main_chain_are_not_taken_for_fingers(
    tmp_path: Path, old: str, new: str, said: str
) -> None:
    """The tool was the link before them, silently."""
    text = (FOLDER / "three_planar.urdf").read_text()
    assert old in text
    urdf = tmp_path / "changed.urdf"
    urdf.write_text(text.replace(old, new))
    result = CliRunner().invoke(main, ["import-urdf", str(urdf), "-o", str(tmp_path / "arm.toml")])
    assert result.exit_code == 2
    assert said in result.output


@pytest.mark.parametrize("slides", ["j1", "j2", "j3"])
def test_a_joint_that_slides_is_in_mm(tmp_path: Path, slides: str) -> None:
    """Its limits and speed in m, friction in N; it is not taken for a finger."""
    urdf, out = tmp_path / "slide.urdf", tmp_path / "arm.toml"
    text = (FOLDER / "three_planar.urdf").read_text()
    text = text.replace(f'name="{slides}" type="revolute"', f'name="{slides}" type="prismatic"')
    text = text.replace('<link name="tool"/>', f'<link name="tool">{INERTIAL}</link>')
    text = text.replace("</joint>", '<dynamics friction="1.5" damping="2.5"/></joint>')
    urdf.write_text(text)
    result = CliRunner().invoke(main, ["import-urdf", str(urdf), "-o", str(out)])
    assert result.exit_code == 0, result.output
    content = out.read_text()
    assert content.count("mm_per_rev = 8.0") == content.count("speed_mm_s = ") == 1
    assert ("friction_n = 1.5" in content) == (slides == "j3")
    out.write_text(content.replace("# motor", "motor").replace("# limits", "limits"))
    arm = Arm.load(out)
    (joint,) = (joint for joint in arm.driven if joint.slides)
    assert joint.name == slides
    assert joint.range_deg[1] == pytest.approx({"j1": 2.5, "j2": 2.0, "j3": 3.0}[slides] * 1000)
    rng = np.random.default_rng(SEED)
    for at in rng.uniform(-2.0, 2.0, (20, len(arm.driven))):
        moved = [
            1000 * value if each.slides else np.degrees(value)
            for each, value in zip(arm.driven, at, strict=True)
        ]
        wanted = tool_pose(urdf, dict(zip((each.name for each in arm.driven), at, strict=True)))
        np.testing.assert_allclose(of_arm.forward(arm, moved), wanted, atol=0.02)


INERTIAL = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
DIFFERENTIAL = """
  <transmission name="wrist">
    <type>transmission_interface/DifferentialTransmission</type>
    <actuator name="a"><role>actuator1</role><mechanicalReduction>50</mechanicalReduction></actuator>
    <actuator name="b"><role>actuator2</role><mechanicalReduction>-40</mechanicalReduction></actuator>
    <joint name="j3"><role>joint2</role><mechanicalReduction>0.5</mechanicalReduction></joint>
    <joint name="j2"><role>joint1</role><mechanicalReduction>2.0</mechanicalReduction></joint>
  </transmission>
"""
FOUR_BAR = """
  <ros2_control name="arm" type="system">
    <transmission name="elbow">
      <plugin>transmission_interface/FourBarLinkageTransmission</plugin>
      <actuator name="a" role="actuator1"/>
      <actuator name="b" role="actuator2"><mechanical_reduction>30</mechanical_reduction></actuator>
      <joint name="j1" role="joint1"/>
      <joint name="j2" role="joint2"><mechanical_reduction>-1.5</mechanical_reduction></joint>
    </transmission>
  </ros2_control>
"""


@pytest.mark.parametrize(
    ("element", "coupling", "ratios"),
    [
        (DIFFERENTIAL, [[1, 0, 0], [0, 2, 0.5], [0, 2, -0.5]], ["= 50", "= -40"]),
        (FOUR_BAR, [[1, 0, 0], [1, -1.5, 0], [0, 0, 1]], ["= 1\n", "= 30"]),
        (DIFFERENTIAL.replace("Differential", "Simple"), [], []),
        ("", [], []),
    ],
)
def test_transmissions_that_couple_joints(
    tmp_path: Path, element: str, coupling: list[list[float]], ratios: list[str]
) -> None:
    """By the formulas of transmission_interface, once the '#' of motors and coupling are taken off."""
    urdf, out = tmp_path / "coupled.urdf", tmp_path / "arm.toml"
    urdf.write_text((FOLDER / "three_planar.urdf").read_text().replace("</robot>", f"{element}</robot>"))
    result = CliRunner().invoke(main, ["import-urdf", str(urdf), "-o", str(out)])
    assert result.exit_code == 0, result.output
    assert ("[coupling]" in result.output) == bool(coupling)
    text = out.read_text()
    assert all(f"gear_ratio {ratio}" in text for ratio in ratios)
    out.write_text(re.sub(r"^# (limits|motor|\[coupling\]|\"j\d\") ?", r"\1 ", text, flags=re.M))
    np.testing.assert_array_equal(np.array(Arm.load(out).coupling), np.array(coupling))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('name="j3"><role', 'name="gripper"><role'),
        (">50<", ">0<"),
        (">50<", "> <"),
        (">50<", ">x<"),
        (">50<", ">nan<"),
        ("Differential", "Planetary"),
    ],
)
def test_transmissions_that_cannot_be_used_are_told(tmp_path: Path, old: str, new: str) -> None:
    urdf = tmp_path / "coupled.urdf"
    element = DIFFERENTIAL.replace(old, new)
    assert element != DIFFERENTIAL
    urdf.write_text((FOLDER / "three_planar.urdf").read_text().replace("</robot>", f"{element}</robot>"))
    result = CliRunner().invoke(main, ["import-urdf", str(urdf), "-o", str(tmp_path / "arm.toml")])
    assert result.exit_code == 0, result.output
    assert "note: transmission 'wrist' couples 'j2' and " in result.output
    assert "[coupling]" not in (tmp_path / "arm.toml").read_text()
