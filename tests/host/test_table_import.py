"""Via points from tables of other programs: their headers, units and turns, and what is refused."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from armtempo.basics.errors import InputError
from armtempo.cli import main
from armtempo.kinematics.of_arm import forward, inverse, inverse_many
from armtempo.model import shipped, via_table
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.parts import Limits
from armtempo.model.pose import from_rpy
from armtempo.model.posture import ArmPosture
from armtempo.model.tool_pose import Pose
from armtempo.planning import planner, point_to_point, recorded, via_points
from click.testing import CliRunner

from tests.host.made_runs import shipped_plan

ARM = Arm.paper()


WIDE = replace(ARM, joints=(replace(ARM.joints[0], range_deg=(-400.0, 400.0)), *ARM.joints[1:]))


def recording(angles: Iterable[float], period_s: float = 0.1) -> str:
    """A table of joint 1, the others at rest."""
    rows = [f"{period_s * line},{angle},-60,40" for line, angle in enumerate(angles)]
    return "\n".join(("time,j1,j2,j3", *rows)) + "\n"


def within_a_turn(angle: float) -> float:
    """From -180 to below 180."""
    return (angle + 180.0) % 360.0 - 180.0


@pytest.mark.parametrize(("start", "end"), [(160, 200), (-160, -200), (170, 390), (0, -400)])
@pytest.mark.parametrize("least", [-180.0, 0.0])
def test_a_recording_within_a_turn_goes_on(tmp_path: Path, start: int, end: int, least: float) -> None:
    """Angles of -180 to 180, or of 0 to 360."""
    table = tmp_path / "recorded.csv"
    step = 2.0 * np.sign(end - start)
    way = np.arange(start, end + step, step)
    told = (way - least) % 360.0 + least
    arm = replace(WIDE, joints=(replace(WIDE.joints[0], range_deg=(-800.0, 800.0)), *ARM.joints[1:]))
    table.write_text(recording(told))
    found = via_table.read(table, arm)
    assert found.via_deg[[0, -1], 0] == pytest.approx(told[0] + np.array([0.0, end - start]))
    if told[-1] != told[0] + end - start:
        assert "recorded within a turn" in found.notes[-1]


def test_a_recording_within_a_turn_may_be_faster_than_the_limit(tmp_path: Path) -> None:
    """As anywhere else in it, if it is as fast before and after the jump."""
    table = tmp_path / "recorded.csv"
    table.write_text(recording(within_a_turn(angle) for angle in np.arange(100.0, 251.0, 10.0)))
    assert via_table.read(table, WIDE).via_deg[[0, -1], 0] == pytest.approx([100.0, 250.0])


@pytest.mark.parametrize("at_end", [False, True])
def test_a_rest_beside_less_than_a_step_is_left_out_or_refused(tmp_path: Path, at_end: bool) -> None:
    """The planner takes its two ends for one point, at which it keeps no rest."""
    table = tmp_path / "recorded.csv"
    angles = [0.0, 0.01, 0.02, *[0.02] * 15, *np.linspace(0.02, 60.0, 40)]
    table.write_text(recording(angles[::-1] if at_end else angles))
    found = via_table.read(table, ARM)
    assert not found.rests_s
    assert found.via_deg[[0, -1], 0] == pytest.approx([60.0, 0.02] if at_end else [0.02, 60.0], abs=0.01)
    assert found.thinned_to_deg is not None
    assert found.thinned_to_deg >= 0.01
    with pytest.raises(InputError, match=f"its {'last' if at_end else 'first'} move, of 0.02 degrees"):
        via_table.read(table, ARM, tolerance_deg=0.005)


def test_a_point_beyond_a_range_is_named_with_its_line(tmp_path: Path) -> None:
    table = tmp_path / "recorded.csv"
    for least in (-10.05, -10.3):
        table.write_text(recording(np.linspace(least, 60.0, 40)))
        with pytest.raises(InputError, match=f"line 2: joint 1 at {least} degrees is outside of its range"):
            via_table.read(table, ARM)


def test_a_recording_that_cannot_go_on_is_refused_with_its_line(tmp_path: Path) -> None:
    table = tmp_path / "recorded.csv"
    table.write_text(recording([176, 178, -180, -178]))
    with pytest.raises(InputError, match="line 5: joint 1 is recorded within a turn, and goes on to 182"):
        via_table.read(
            table, replace(ARM, joints=(replace(ARM.joints[0], range_deg=(-180.0, 181.0)), *ARM.joints[1:]))
        )
    table.write_text(recording([160, 165, -170, -165]))
    with pytest.raises(InputError, match="line 4: joint 1 jumps from 165 to -170 degrees, faster than"):
        via_table.read(table, WIDE)


def test_a_slow_way_back_is_no_jump(tmp_path: Path) -> None:
    table = tmp_path / "recorded.csv"
    table.write_text(recording([170, 0, -170, 0, 170], period_s=5.0))
    assert np.ptp(via_table.read(table, WIDE).via_deg[:, 0]) == 340.0


@pytest.mark.parametrize("high_deg", [400.0, 190.0])
def test_a_coarse_recording_within_a_turn_goes_on_as_its_neighbours_do(
    tmp_path: Path, high_deg: float
) -> None:
    """On a joint that may turn nearly once between two points; the long way, which a range may ask for, is told."""
    first = replace(ARM.joints[0], range_deg=(-400.0, high_deg), limits=Limits(360.0, 500.0, 2000.0))
    arm = replace(ARM, joints=(first, *ARM.joints[1:]))
    table = tmp_path / "recorded.csv"
    way = np.array([160.0, 165.0, 175.0, 185.0, 195.0, 200.0])
    table.write_text(recording(within_a_turn(way), period_s=1.0))  # type: ignore[arg-type]
    found = via_table.recorded(table, arm)
    goes_on = high_deg > 200.0
    np.testing.assert_allclose(found.angles_deg[:, 0], way if goes_on else within_a_turn(way))  # type: ignore[arg-type]
    assert len(found.notes) == goes_on
    if not goes_on:
        told = recorded.plan(arm, "coarse", found.times_s, found.angles_deg, tolerance_deg=20.0).notes
        said = "2 s to 3 s: joint 1 goes 350 degrees from 175 to -175; 185, 10 the other way, is in its range too"
        assert said in told


NEAR = 90.0 + 1e-4 / ARM.driven[0].steps_per_deg
"""Beyond a range to 90 by less than rounding in single precision."""


def pose_angles(arm: Arm, first_deg: float) -> list[float]:
    """The nearest posture for the pose with joint 1 at this angle, of one pose and of many: joints 1 to 3."""
    pose, near = (
        forward(arm, (first_deg, -60.0, 40.0, 10.0, 20.0, 30.0)),
        (80.0, -60.0, 40.0, 10.0, 20.0, 30.0),
    )
    one, many = inverse(arm, pose, near)[0], inverse_many(arm, [pose], near)
    assert one.usable
    np.testing.assert_allclose(one.angles_deg, many.nearest_deg[0], atol=1e-9)
    assert one.angles_deg[0] == 90.0
    return list(one.angles_deg[:3])


def test_rounding_beyond_a_range_is_its_end(tmp_path: Path) -> None:
    """Of a table, a job, a posture of the arm file, a move, a sequence, a pose, and of home_deg."""
    first = replace(ARM.joints[0], range_deg=(-90.0, 90.0))
    arm = replace(ARM, joints=(first, *ARM.joints[1:]))
    table = tmp_path / "via.csv"
    table.write_text("j1 (rad),j2 (deg),j3 (deg)\n1.570796327,-60,40\n-1.5707964,-60,40\n")
    for job in (
        Job.from_csv(table, arm),
        Job("near", via_deg=[(NEAR, -60, 40), (180.0 - NEAR - 180.0, -60, 40)]),
    ):
        angles, _ = planner.via_angles(arm, job)
        assert angles[:, 0].tolist() == [90.0, -90.0]
    assert arm.angles_problem((NEAR, -60.0, 40.0)) == ""
    assert point_to_point.posture((NEAR, -60.0, 40.0), arm)[0] == 90.0
    assert via_points.posture_deg(arm, ArmPosture("near", (NEAR, -60.0, 40.0)))[0] == 90.0
    assert pose_angles(arm, NEAR) == pytest.approx([90.0, -60.0, 40.0], abs=1e-4)
    path = tmp_path / "arm.toml"
    text = shipped.arm_path().read_text()
    path.write_text(text.replace("range_deg = [-10.0, 190.0]", "range_deg = [1e-8, 190.0]"))
    assert Arm.load(path).all_home_deg[0] == 1e-8
    path.write_text(text.replace("range_deg = [-10.0, 190.0]", "range_deg = [1e-3, 190.0]"))
    with pytest.raises(
        InputError, match=r"joint\[1\]\.home_deg = 0\.0 is not allowed; give .* at least 0\.001"
    ):
        Arm.load(path)
    for beyond in (90.01, -90.01):
        assert "outside of its range" in arm.angles_problem((beyond, -60.0, 40.0))
        with pytest.raises(InputError, match="outside of its range"):
            point_to_point.posture((beyond, -60.0, 40.0), arm)


RAD = ("0,-1.0471975511965976,0.6981317007977318", "0.349065850,-1.308996939,0.872664626")


@pytest.mark.parametrize(
    ("text", "radians"),
    [
        ("0,-60,40\n20,-75,50\n", None),
        ("joint 3,joint 1,joint 2\n40,0,-60\n\n50,20,-75\n", None),
        ("J3,J1,J2\n40,0,-60\n50,20,-75\n", None),
        ("Joint 3, JOINT_1, Joint2\n40,0,-60\n50,20,-75\n", None),
        ("q3_deg,q1_deg,joint_2_position (deg)\n40,0,-60\n50,20,-75\n", None),
        ("time_s,j1_angle_deg,j2_angle_deg,j3_angle_deg\n8,0,-60,40\n9,20,-75,50\n", None),
        ("joint 1,joint 2,joint 3,joint 5\n0,-60,40,0\n20,-75,50,0\n", None),
        ("# axis 2,axis 1,axis 3\n-60,0,40\n# a remark\n-75,20,50\n", None),
        ("# a remark\n# j3 j1 j2\n40 0 -60\n50 20 -75\n", None),
        ("#j3,j1,j2\n40 0 -60\n50 20 -75\n", None),
        ("# j3 j1 j2\n40,0,-60\n50,20,-75\n", None),
        ("0;-60;40\n20;-75;50\n", None),
        ("joint 1;joint 2;joint 3;\n0,0;-60,0;40,0;\n20,0;-75,0;50,0;\n", None),
        ("0\t-60\t40\n20\t-75\t50\n", None),
        ("0  -60   40\n 20 -75 50\n", None),
        ("joint 2  joint 1  joint 3\n-60 0 40\n-75 20 50\n", None),
        ("j2 j1 j3\n-60 0 40\n-75 20 50\n", None),
        ("joint 2 joint 1 joint 3 (rad)\n-60 0 0.698131701\n-75 20 0.872664626\n", None),
        ("# joint 2 joint 1 joint 3\n-60 0 40\n-75 20 50\n", None),
        ("j2 j1 j3\n-60,0,40\n-75,20,50\n", None),
        ("time s joint 2 deg joint 1 deg joint 3 rad\n8 -60 0 0.698131701\n9 -75 20 0.872664626\n", None),
        ("time s joint 2 joint 1 joint 3\n8,-60,0,40\n9,-75,20,50\n", None),
        ("joint 2,joint 1,joint 3\n-60 0 40\n-75 20 50\n", None),
        ("joint 2,joint 1,joint 3\n-60;0;40\n-75;20;50\n", None),
        ('"j2", "j1", "j3"\n-60, 0, 40\n-75, 20, 50\n', None),
        ('"joint 2" "joint 1" "joint 3"\n-60 0 40\n-75 20 50\n', None),
        ("\ufeffj1\tj2\tj3\r\n0\t-60\t4e1\r\n20\t-75\t50\r\n", None),
        ("\n".join(RAD), True),
        ("\n".join(("joint 1 (rad),joint 2 [rad],joint_3_rad", *RAD)), None),
        ("t,j1,j2,j3\nms,deg,[rad],DEG\n0,0,-1.0471975512,40\n900,20,-1.3089969390,50\n", None),
        ("j1;j2;j3;j1 speed\n(deg);(deg);(deg);deg/s\n0,0;-60;40;1\n20;-75;50;1\n", None),
        ("j2 j1 j3\ndeg deg deg\n-60 0 40\n-75 20 50\n", None),
        ("# j1,j2,j3\n# deg,deg,deg\n0,-60,40\n20,-75,50\n", None),
        ("joint 1 (deg),joint 2 (rad),joint 3\n0,-1.0471975512,40\n20,-1.3089969390,50\n", None),
    ],
)
def test_via_points_come_from_any_sensible_table(tmp_path: Path, text: str, radians: bool | None) -> None:
    table = tmp_path / "via.csv"
    table.write_text(text, encoding="utf-8")
    np.testing.assert_allclose(
        via_table.read(table, ARM, radians).via_deg[[0, -1]],
        [[0, -60, 40], [20, -75, 50]],
        atol=1e-6,
    )


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "0 via points"),
        ("0,-60,40\n", "1 via points"),
        ("0,-60,40\n20,-75\n", "line 2: 2 values"),
        ("0,-60,40\n20,-75,50,60\n", "line 2: 4 values"),
        ("0,-60,40\n20,x,50\n", "line 2: 'x' is not a finite number"),
        ("0,-60,40\n20,nan,50\n", "line 2: 'nan'"),
        ("0,-60,inf\n20,-75,50\n", "line 1: 'inf'"),
        ("0,-6o,40\n20,-75,50\n", "line 1: '-6o' is no number"),
        ("0,-60,40,1\n20,-75,50,2\n", "line 1: 4 columns without a header.*time.*time_s,joint 1"),
        ("0,-60\n20,-75\n", "line 1: 2 columns without a header, but 3 joints"),
        ("joint 1,joint 2\n1,2\n", "line 1: the header does not name"),
        ("j1 j2\n0,-60,40\n20,-75,50\n", "line 2: 3 values, but not as many names in the header"),
        ("j1,j2,j3\n1_0,-60,40\n20,-75,50\n", "line 2: '1_0' is not a finite number"),
        ("j0,j1,j2,j3\n0,-60,40,1\n20,-75,50,1\n", "line 1: 'j0' counts the joints from 0; count from 1"),
        ("a,b,c\n0,-60,40\n20,-75,50\n", "does not name.*joint 1,joint 2,joint 3"),
        ("time,shoulder,elbow\n0,-60,40\n1,-75,50\n", "does not name"),
        ("joint 1,joint 2,joint 2\n0,-60,40\n1,-75,50\n", "line 1: two columns are called 'joint2'"),
        ("joint 1,j2,joint 2,joint 3\n0,-60,1,40\n1,-75,1,50\n", "'j2' and 'joint 2' both name joint 2"),
        ("j1 (gon),j2,j3\n0,-60,40\n1,-75,50\n", "'j1 \\(gon\\)': the unit is not known"),
        ("j1 (rad),j2,j3\ndeg,deg,deg\n0,-60,40\n1,-75,50\n", "'j1 .rad.' is in deg by the line below"),
        ("j1,j2,j3\ndeg,deg,degs\n0,-60,40\n1,-75,50\n", "'j3 .degs.': the unit is not known"),
        ("j1,j2,j3\nrad,rad\n0,-60,40\n1,-75,50\n", "line 2: 2 values, but 3 columns"),
        (
            "j1,j2,j3,j4\n0,-60,40,0\n20,-75,50,9\n",
            "line 3: joint 4 at 9 degrees has no motor, it stays at 0",
        ),
        ("joint 1;joint 2;joint 3\n0;-60;40\n1;2\n", "line 3: 2 values"),
        ("time_s,joint 1,joint 2,joint 3\n1,0,-60,40\n1,20,-75,50\n", "line 3: the time does not increase"),
        ("time,j1,j2,j3\n0,0,-60,40\n100,20,-75,50\n", "seconds or milliseconds.*time_s, time_ms"),
        ("\n".join(RAD), "no angle without a unit is beyond 1.31: degrees or radians.*--radians"),
        ("\n".join(("j1,j2,j3", *RAD)), "degrees or radians"),
        ("\n".join(("j1 (rad),j2,j3", *RAD)), "beyond 1.31: degrees or radians.*joint 2 \\(rad\\)"),
        ("0,1,2\n0,-60,40\n20,-75,50\n", "line 1: 0,1,2 are the numbers of columns.*joint 1,joint 2,joint 3"),
        ("1,2,3\n0,-60,40\n20,-75,50\n", "line 1: 1,2,3 are the numbers of columns"),
        (
            "x_mm,y_mm,z_mm,roll,pitch,yaw\n200,0,100,3.1416,0,1.5708\n300,0,100,3.1416,0,1.5708\n",
            "beyond 3.14: degrees or radians.*roll \\(rad\\)",
        ),
        ("x_mm,y_mm\n1,2\n3,4\n", "does not name"),
        ("x,y,z\n0.2,0,0.1\n0.3,0,0.1\n", "mm or metres.*x_m,y_m,z_m"),
        ("x,y,z,rx,ry,rz\n200,0,100,0,0,0\n300,0,100,0,0,0\n", "'rx' is not known as part of a pose"),
        ("x,y,z,qw,qx,qy\n200,0,100,1,0,0\n300,0,100,1,0,0\n", "qw, qx, qy are not an orientation"),
        ("t,x,y,z\n0,200,0,100\n1,300,0,100\n", "poses are not thinned"),
    ],
)
def test_a_table_that_will_not_do_is_refused_with_its_line(tmp_path: Path, text: str, said: str) -> None:
    table = tmp_path / "via.csv"
    table.write_text(text)
    with pytest.raises(InputError, match=said):
        via_table.read(table, ARM)


def test_a_wide_joint_may_be_in_radians_beside_narrow_and_sliding_ones(tmp_path: Path) -> None:
    table = tmp_path / "via.csv"
    narrow = replace(ARM, joints=(replace(ARM.joints[0], range_deg=(-50.0, 50.0)), *ARM.joints[1:]))
    sliding = "z (mm),joint 1,joint 2,joint 3\n10,0,0.5,0\n20,0.4,1,0\n"
    for arm, text in ((narrow, "\n".join(RAD)), (Arm.load("scara_z"), sliding)):
        table.write_text(text)
        with pytest.raises(InputError, match="degrees or radians"):
            via_table.read(table, arm)


def test_a_unit_of_the_header_is_not_overruled(tmp_path: Path) -> None:
    table = tmp_path / "via.csv"
    table.write_text("\n".join(("joint 1 (rad),joint 2 (rad),joint 3 (rad)", *RAD)))
    with pytest.raises(InputError, match="other units than --degrees"):
        via_table.read(table, ARM, radians=False)


@pytest.mark.parametrize(
    ("text", "rotation"),
    [
        ("z_mm,x_mm,y_mm,yaw_deg,pitch_deg,roll_deg\n20,300,10,30,20,10\n25,310,10,30,20,10\n", (10, 20, 30)),
        ("z_m,x_m,y_m\n0.02,0.3,0.01\n0.025,0.31,0.01\n", None),
        ("x y z qw qx qy qz\n300 10 20 0 1 0 0\n310 10 25 0 1 0 0\n", (180, 0, 0)),
        ("X,Y,Z,pitch (rad)\n300,10,20,1.5707963267949\n310,10,25,1.5707963267949\n", (0, 90, 0)),
    ],
)
def test_a_table_of_poses_becomes_poses(
    tmp_path: Path, text: str, rotation: tuple[float, float, float] | None
) -> None:
    table = tmp_path / "poses.csv"
    table.write_text(text)
    first, second = Job.from_csv(table, ARM).via
    assert isinstance(first, Pose)
    assert isinstance(second, Pose)
    np.testing.assert_allclose([row[3] for row in first.matrix[:3]], [300, 10, 20])
    np.testing.assert_allclose([row[3] for row in second.matrix[:3]], [310, 10, 25])
    if rotation is None:
        assert first.fixed == ()
    else:
        np.testing.assert_allclose(first.matrix, from_rpy((300, 10, 20), rotation), atol=1e-9)


def test_numbers_of_joints_are_not_guessed_where_they_are_ambiguous(tmp_path: Path) -> None:
    first, second, third = ARM.joints[:3]
    arm = replace(ARM, joints=(first, replace(second, motor=None), third, *ARM.joints[3:]))
    table = tmp_path / "via.csv"
    table.write_text("j1,j2\n0,40\n20,50\n")
    with pytest.raises(InputError, match="joint 1,joint 3"):
        via_table.read(table, arm)
    table.write_text("joint 3,joint 1\n40,0\n50,20\n")
    np.testing.assert_allclose(via_table.read(table, arm).via_deg, [[0, 40], [20, 50]])


def test_columns_that_are_not_read_are_named(tmp_path: Path) -> None:
    table = tmp_path / "via.csv"
    table.write_text("j1,j2,j3,gripper,j1_speed_deg_s\n0,-60,40,1,0\n20,-75,50,1,0\n")
    assert via_table.read(table, ARM).notes == ("columns that were not used: gripper",)
    table.write_text("0,-60,40\n20,-75,50\n")
    assert via_table.read(table, ARM).notes == (
        "no header: the columns were taken as joint 1,joint 2,joint 3",
    )


def test_a_recording_beyond_a_range_is_refused_with_its_line(tmp_path: Path) -> None:
    table = tmp_path / "recorded.csv"
    table.write_text(recording([-9.0, -10.04, -9.0]))
    assert via_table.read(table, ARM).via_deg[:, 0].min() >= -10.0
    table.write_text(recording([-9.0, -10.2, -9.0]))
    with pytest.raises(
        InputError, match=r"line 3: joint 1 at -10.2 degrees is outside of its range -10 to 190"
    ):
        via_table.read(table, ARM)


@pytest.mark.slow
def test_the_commands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    shipped_plan().save("feed.json")
    run = CliRunner(env={"ARMTEMPO_ARM": str(shipped.arm_path())}).invoke
    assert run(main, ["export", "feed.json", "--rate", "2", "-o", "feed.csv"]).exit_code == 0
    assert run(main, ["export", "feed.json", "--format", "ros"]).output.startswith("header:")
    made = run(main, ["import", "feed.csv", "--name", "again"])
    assert made.exit_code == 0, made.output
    assert re.match(
        r"15 lines reduced to \d+ via points: the planned path stays within 0.\d+ deg of the table \(proven\); ",
        made.output,
    )
    assert Job.load("again.toml", ARM).timing == "shared"
    assert run(main, ["import", "feed.csv", "--name", "again"]).exit_code == 0  # the same content
    Path("again.toml").write_text("# mine")
    again = run(main, ["import", "feed.csv", "--name", "again"])
    assert again.exit_code == 2
    assert "exists" in again.output
    assert Path("again.toml").read_text() == "# mine"
    Path("out.csv").write_text("0,-60,40\n900,0,0\n")
    outside = run(main, ["import", "out.csv"])
    assert outside.exit_code == 2
    assert "out.csv: via_deg P1 = [900, 0, 0]" in outside.output
    assert "range of joint 1" in outside.output
    named = run(main, ["import", "feed.csv", "--name", 'a"b'])
    assert """feed.csv: name = 'a"b' is not allowed""" in named.output
    assert not Path("out.toml").exists()


def test_a_tolerance_of_joints_that_the_arm_has_not_is_refused(tmp_path: Path) -> None:
    table = tmp_path / "a.csv"
    table.write_text("j1,j2,j3\n0,-60,40\n10,-50,45\n", encoding="utf-8")
    result = CliRunner().invoke(main, ["import", str(table), "--tolerance-mm", "1", "--arm", "paper"])
    assert result.exit_code == 2
    assert "--tolerance-mm: arm" in result.output
    assert "has no sliding joint" in result.output
