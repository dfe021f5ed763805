"""Via points: from poses, with notes on what the user must know, and from and to tables of other programs."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from armtempo.basics.errors import InputError, PlanError
from armtempo.cli import main
from armtempo.kinematics import Geometry, forward
from armtempo.model import exchange, shipped, thinning, via_table
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.plan import Plan
from armtempo.model.pose import from_rpy
from armtempo.model.posture import ArmPosture
from armtempo.model.tool_pose import Pose
from armtempo.planning import planner, point_to_point, via_points
from armtempo.splines import bspline
from click.testing import CliRunner
from scipy.spatial import cKDTree

from tests.host import problems
from tests.host.arms import FOUR, asked
from tests.host.made_runs import shipped_plan

ARM = Arm.paper()
GEOMETRY = Geometry.of(ARM)
JOB = Job.paper(ARM)
ALL_DRIVEN = replace(
    ARM,
    joints=tuple(
        joint if joint.motor else replace(joint, motor=ARM.joints[0].motor, limits=ARM.joints[0].limits)
        for joint in ARM.joints
    ),
)


def pose_of(*angles_deg: float, arm: Arm = ARM, posture_deg: tuple[float, ...] | None = None) -> Pose:
    """The pose of these joint angles; the wrist at home if only three are given."""
    angles = np.radians([*angles_deg, 0.0, 0.0, 0.0][:6])
    return replace(Pose.of_matrix(forward(Geometry.of(arm), angles)), posture_deg=posture_deg)


def job(*via: tuple[float, ...] | Pose) -> Job:
    return replace(JOB, via=via)


def test_the_paper_s_motion_given_as_poses_comes_out_as_its_angles() -> None:
    poses = job(*(pose_of(*angles) for angles in JOB.via))
    resolved = via_points.resolve(ARM, poses)
    np.testing.assert_allclose(resolved.via_deg, JOB.via, atol=1e-9)
    assert resolved.notes == ()
    angles, _ = planner.via_angles(ARM, poses)
    np.testing.assert_array_equal(angles, resolved.via_deg)


def test_angles_and_poses_may_be_mixed() -> None:
    mixed = job(*(pose_of(*angles) if number % 2 else angles for number, angles in enumerate(JOB.via)))
    resolved = via_points.resolve(ARM, mixed)
    np.testing.assert_allclose(resolved.via_deg, JOB.via, atol=1e-9)
    assert resolved.notes == ()


def test_angles_alone_stay_to_the_last_bit() -> None:
    np.testing.assert_allclose(via_points.resolve(ARM, JOB).via_deg, JOB.via, rtol=1e-15)


def test_all_six_joints_driven() -> None:
    angles = ((10.0, -60.0, 40.0, 20.0, 30.0, 40.0), (60.0, -80.0, 50.0, 60.0, 20.0, 300.0))
    resolved = via_points.resolve(ALL_DRIVEN, job(angles[0], pose_of(*angles[1], arm=ALL_DRIVEN)))
    # Joint 6 is at -60, the turn nearer to where it was.
    np.testing.assert_allclose(
        resolved.via_deg, [angles[0], (60.0, -80.0, 50.0, 60.0, 20.0, -60.0)], atol=1e-9
    )
    assert resolved.notes == ()


def test_a_pose_that_needs_undriven_joints_is_reported_with_the_miss() -> None:
    resolved = via_points.resolve(ARM, job(JOB.via[0], pose_of(20.0, -75.0, 50.0, 0.0, 30.0, 0.0)))
    np.testing.assert_allclose(resolved.via_deg[1], [20.0, -75.0, 50.0], atol=1e-9)
    (note,) = resolved.notes
    assert (note.kind, note.via) == ("undriven", 1)
    # d6 = 40 mm turned by 30 degrees: 2 * 40 * sin(15) = 20.71.
    assert note.text == (
        "P1: the pose needs joints that have no motor: joint 5 at 30 deg (stays at 0); "
        "the tool misses the pose by 20.71 mm and 30 deg"
    )


def test_a_solution_with_the_undriven_joints_at_home_comes_before_a_nearer_one() -> None:
    """Rear, elbow up reaches it with the wrist at home; front would be nearer to where the arm is."""
    wished = pose_of(0.0, -93.0, -140.0)
    assert via_points.resolve(ARM, job((5.0, -93.0, -140.0), wished)).notes == ()
    far = via_points.resolve(ARM, job((180.0, -38.0, -52.0), wished))
    np.testing.assert_allclose(far.via_deg[1], [0.0, -93.0, -140.0], atol=1e-9)
    assert "undriven" not in {note.kind for note in far.notes}


def test_posture_deg_decides() -> None:
    wished = (0.0, -93.0, -157.0, 0.0, -19.0, 180.0)  # row 5 of Table 2
    via = pose_of(180.0, -38.0, -52.0, posture_deg=wished)
    resolved = via_points.resolve(ARM, job(JOB.via[0], via))
    np.testing.assert_allclose(resolved.via_deg[1], [0.0, -93.242, -157.541], atol=1e-3)
    assert {note.kind for note in resolved.notes} == {"undriven", "branch"}


def test_a_branch_change_is_reported_with_the_reason() -> None:
    resolved = via_points.resolve(
        ARM, job((40.0, -110.0, 70.0), pose_of(150.0, -93.0, -140.0), (40.0, -110.0, 70.0))
    )
    first, second = resolved.notes
    assert (first.kind, first.via, second.kind, second.via) == ("branch", 1, "branch", 2)
    assert "between P0 and P1 the arm changes its branch (base): from front up to rear up" in first.text
    assert "Staying in front up plain is not possible: out of reach by 33.1682 mm" in first.text
    assert "between P1 and P2" in second.text


def test_a_branch_change_by_way_of_a_straight_wrist_is_reported() -> None:
    bends = (20.0, 0.0, -20.0)
    poses = (pose_of(0.0, -60.0, 40.0, 10.0, bend, 30.0, arm=ALL_DRIVEN) for bend in bends)
    postures = ((0.0, -60.0, 40.0, 10.0, bend, 30.0) for bend in bends)
    vias_given = [replace(each, posture_deg=posture) for each, posture in zip(poses, postures, strict=True)]
    resolved = via_points.resolve(ALL_DRIVEN, job(*vias_given))
    np.testing.assert_allclose(resolved.via_deg[:, 4], bends, atol=1e-9)
    (note,) = resolved.notes
    assert (note.kind, note.via) == ("branch", 2)
    assert "(wrist): from front up plain to front up flipped" in note.text


def test_a_branch_change_between_angles_the_user_gave_is_his_own() -> None:
    assert via_points.resolve(ARM, job((40.0, -110.0, 70.0), (150.0, -93.0, -140.0))).notes == ()


@pytest.mark.slow
def test_a_pose_out_of_reach_is_refused_with_every_reason() -> None:
    far = Pose.of_angles((3000.0, 0.0, 0.0), {"roll": 0.0, "pitch": 0.0, "yaw": 0.0})
    with pytest.raises(PlanError, match="P1: no posture reaches this pose within") as caught:
        via_points.resolve(ARM, job(JOB.via[0], far))
    first, columns, front, rear = str(caught.value).splitlines()
    assert "misses it by 2193 mm and" in first
    assert "bring the pose nearer to the arm" in first
    assert columns.split() == ["solution", "why", "not"]
    assert front.startswith("  1, 2, 3, 4  out of reach by 2425.18 mm:")
    assert rear.startswith("  5, 6, 7, 8  out of reach by 2225.51 mm:")


def test_a_pose_out_of_the_driven_ranges_is_refused_with_the_joint() -> None:
    with pytest.raises(PlanError, match=r"joint 1 at -60 deg is 50 deg below its range -10 to 190"):
        via_points.resolve(ARM, job(JOB.via[0], pose_of(-60.0, 0.0, 0.0)))


@pytest.mark.parametrize(
    ("via", "words"),
    [
        ((1.0, 2.0), "P1: 2 angles, but 3 joints have a motor"),
        (
            Pose.of_matrix(np.diag((2.0, 1.0, 1.0, 1.0))),
            "not a rot",
        ),
        (pose_of(0.0, -60.0, 40.0, posture_deg=(1.0, 2.0)), "posture_deg has 2 angles, not 6"),
    ],
)
def test_wrong_via_points_are_named(via: tuple[float, ...] | Pose, words: str) -> None:
    with pytest.raises(InputError, match="P1") as caught:
        via_points.resolve(ARM, job(pose_of(0.0, -60.0, 40.0), via))
    assert words in str(caught.value)


def test_plan_prints_the_notes(tmp_path: Path) -> None:
    rows = pose_of(20.0, -75.0, 50.0, 0.0, 30.0, 0.0).matrix
    file = tmp_path / "job.toml"
    file.write_text(
        'name = "posed"\npath = "through"\npopulation = 4\niterations = 5\n'
        "[[via]]\nangles_deg = [0.0, -60.0, 40.0]\n"
        f"[[via]]\nmatrix = {[list(map(float, row)) for row in rows]}\n"
    )
    output = tmp_path / "posed.json"
    result = CliRunner().invoke(
        main, ["plan", "--arm", str(shipped.arm_path()), "--job", str(file), "-o", str(output)]
    )
    assert result.exit_code == 0, result.output
    assert "note: P1: the pose needs joints that have no motor: joint 5 at 30 deg" in result.output
    plan = Plan.load(output)
    np.testing.assert_allclose(plan.via_deg, [[0.0, -60.0, 40.0], [20.0, -75.0, 50.0]], atol=1e-9)


def test_a_position_alone_is_reached_by_the_joints_with_a_motor() -> None:
    wanted = Pose.of_angles((300.0, 200.0, 60.0), {})
    resolved = via_points.resolve(ARM, job(JOB.via[0], wanted))
    tool = forward(GEOMETRY, np.radians([*resolved.via_deg[1], 0.0, 0.0, 0.0]))
    np.testing.assert_allclose(tool[:3, 3], (300.0, 200.0, 60.0), atol=1e-6)
    assert resolved.notes == ()


def test_four_joints_take_position_and_pitch_near_to_the_via_point_before() -> None:
    angles = ((10.0, 60.0, -80.0, -50.0), (30.0, 70.0, -90.0, -60.0), (60.0, 80.0, -100.0, -40.0))
    poses = (asked(forward(Geometry.of(FOUR), np.radians(each)), ("pitch",)) for each in angles[1:])
    resolved = via_points.resolve(FOUR, job(angles[0], *poses))
    np.testing.assert_allclose(resolved.via_deg, angles, atol=1e-6)
    assert resolved.notes == ()


def test_a_pose_within_its_tolerance_is_taken_with_a_note_of_the_miss() -> None:
    off = from_rpy((345.0, 120.0, 60.0), (90.0, 0.0, 19.9))
    refused = Pose.of_matrix(off)
    with pytest.raises(
        PlanError, match=r"P1: .* 0\.1 mm and 0\.1 deg: the nearest one that was found misses it by"
    ):
        via_points.resolve(FOUR, job((0.0, 60.0, -80.0, -50.0), refused))
    wider = replace(Pose.of_matrix(off), tolerance_deg=1.0)
    resolved = via_points.resolve(FOUR, job((0.0, 60.0, -80.0, -50.0), wider))
    (note,) = resolved.notes
    assert (note.kind, note.via) == ("miss", 1)
    assert note.text.startswith("P1: the tool misses the pose by ")
    assert note.text.endswith(" deg (0.1 mm and 1 deg allowed)")


def test_a_tolerance_decides_whether_undriven_joints_are_missed() -> None:
    nearly = pose_of(20.0, -75.0, 50.0, 0.0, 0.05, 0.0)
    (note,) = via_points.resolve(ARM, job(JOB.via[0], nearly)).notes
    assert note.kind == "miss"
    narrow = replace(nearly, tolerance_deg=0.02)
    (note,) = via_points.resolve(ARM, job(JOB.via[0], narrow)).notes
    assert note.kind == "undriven"


@pytest.mark.slow
def test_an_arm_outside_the_class_is_served_numerically() -> None:
    bent = tuple(
        replace(joint, a_mm=10.0) if number == 3 else joint for number, joint in enumerate(ARM.joints)
    )
    arm = replace(ARM, joints=bent)
    angles = JOB.via[0]
    assert not isinstance(angles, Pose)
    resolved = via_points.resolve(arm, job(angles, pose_of(10.0, -70.0, 45.0, arm=arm)))
    np.testing.assert_allclose(resolved.via_deg[1], [10.0, -70.0, 45.0], atol=1e-5)
    far = Pose.of_angles((3000.0, 0.0, 0.0), {"roll": 0.0, "pitch": 0.0, "yaw": 0.0})
    with pytest.raises(
        PlanError, match=r"no posture reaches this pose within .* mm and .* deg: the nearest one"
    ):
        via_points.resolve(arm, job(angles, far))


# export and import: what is written says what the plan says, and comes back


def test_csv_is_the_trajectory_at_any_rate_end_included() -> None:
    plan = shipped_plan()
    rows = list(csv.DictReader(plan.to_csv(37.0).splitlines()))
    assert len(rows[0]) == 1 + 3 * len(exchange.CSV_COLUMNS)
    times = np.array([float(row["time_s"]) for row in rows])
    exact = exchange.times_s(plan.trajectory.duration_s, 37.0)
    np.testing.assert_allclose(times, exact, atol=1e-9)
    assert exact[-1] == plan.trajectory.duration_s
    for order, name in enumerate(exchange.CSV_COLUMNS):
        found = np.array([[float(row[f"j{joint}_{name}"]) for joint in (1, 2, 3)] for row in rows])
        np.testing.assert_allclose(found, plan.trajectory(exact, order), atol=2e-5)


def test_a_plan_has_a_hundred_points_a_second() -> None:
    plan = shipped_plan()
    points = len(exchange.times_s(plan.trajectory.duration_s, 100.0))
    assert plan.to_csv().count("\n") == 1 + points
    assert plan.to_ros().count("time_from_start") == points


def test_ros_points_are_in_radians_and_in_order() -> None:
    plan = shipped_plan()
    text = plan.to_ros(10.0, "base_link")
    assert "frame_id: 'base_link'" in text
    assert "joint_names: ['joint 1', 'joint 2', 'joint 3']" in text
    points = [line for line in text.splitlines() if line.startswith("- positions: ")]
    assert len(points) == len(exchange.times_s(plan.trajectory.duration_s, 10.0))
    last = [float(value) for value in points[-1].removeprefix("- positions: [").rstrip("]").split(",")]
    np.testing.assert_allclose(last, np.radians([180, -38, -52]), atol=1e-9)
    assert "time_from_start: {sec: 0, nanosec: 100000000}" in text


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


def test_a_long_way_round_is_said() -> None:
    job = Job("round", via_deg=[(350.0, -60.0, 40.0), (10.0, -60.0, 40.0)])
    (note,) = planner.via_angles(WIDE, job)[1]
    assert note == (
        "P0 to P1: joint 1 goes 340 degrees from 350 to 10; 370, 20 the other way, is in its range too"
    )


@pytest.mark.parametrize("numerical", [False, True])
def test_a_pose_is_reached_the_short_way(numerical: bool) -> None:
    six = Arm.of("parol6")
    joints = tuple(
        replace(each, range_deg=(each.range_deg[0] - 400.0, each.range_deg[1] + 400.0)) for each in six.joints
    )
    arm = replace(six, joints=joints)
    start = np.array([175.0, -100.0, 200.0, 175.0, 40.0, -178.0])
    end = start + np.array([10.0, 3.0, -4.0, 10.0, 2.0, -12.0])
    pose = Pose.of_matrix(forward(Geometry.of(arm), np.radians(end)))
    if numerical:
        pose = replace(Pose.of_approach(pose_position(pose), np.array(pose.matrix)[:3, 2]))
    angles, notes = planner.via_angles(arm, Job("short", via=(tuple(start), pose)))
    assert np.abs(angles[1] - angles[0]).max() < 60.0
    assert notes == ()


def pose_position(pose: Pose) -> list[float]:
    return [row[3] for row in pose.matrix[:3]]


@pytest.mark.parametrize("rate", [1.0, 100.0, 333.3, 1e5])
@pytest.mark.parametrize("more_s", [-3e-10, 0.0, 3e-10, 1e-8, 1e-6])
def test_stamps_rise_in_nanoseconds(rate: float, more_s: float) -> None:
    stamps = [round(1e9 * time) for time in exchange.times_s(1.0 + more_s, rate)]
    assert stamps == sorted(set(stamps))
    assert stamps[-1] == round(1e9 * (1.0 + more_s))


def test_exports_give_back_the_same_numbers() -> None:
    plan = shipped_plan()
    times = exchange.times_s(plan.trajectory.duration_s, 10.0)
    rows = list(csv.DictReader(plan.to_csv(10.0).splitlines()))
    assert [float(row["j2_angle_deg"]) for row in rows] == plan.trajectory(times)[:, 1].tolist()
    points = [line for line in plan.to_ros(10.0).splitlines() if line.startswith("- positions: ")]
    found = [[float(each) for each in point[14:-1].split(",")] for point in points]
    assert found == np.radians(plan.trajectory(times)).tolist()


NEAR = 90.0 + 1e-4 / ARM.driven[0].steps_per_deg
"""Beyond a range to 90 by less than rounding in single precision."""


def test_rounding_beyond_a_range_is_its_end(tmp_path: Path) -> None:
    """Of a table, a job, a posture of the arm file, a move and a sequence."""
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
    for beyond in (90.01, -90.01):
        assert "outside of its range" in arm.angles_problem((beyond, -60.0, 40.0))
        with pytest.raises(InputError, match="outside of its range"):
            point_to_point.posture((beyond, -60.0, 40.0), arm)


def test_the_start_is_there_at_any_rate() -> None:
    assert exchange.times_s(7.0, 1e-300).tolist() == [0.0, 7.0]


@pytest.mark.parametrize("rate", [0.0, -1.0, float("nan"), 1e9])
def test_an_impossible_rate_is_refused(rate: float) -> None:
    with pytest.raises(InputError, match="not allowed"):
        exchange.times_s(1.0, rate)


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
        ("0;-60;40\n20;-75;50\n", None),
        ("joint 1;joint 2;joint 3;\n0,0;-60,0;40,0;\n20,0;-75,0;50,0;\n", None),
        ("0\t-60\t40\n20\t-75\t50\n", None),
        ("0  -60   40\n 20 -75 50\n", None),
        ("joint 2  joint 1  joint 3\n-60 0 40\n-75 20 50\n", None),
        ("j2 j1 j3\n-60 0 40\n-75 20 50\n", None),
        ("\ufeffj1\tj2\tj3\r\n0\t-60\t4e1\r\n20\t-75\t50\r\n", None),
        ("\n".join(RAD), True),
        ("\n".join(("joint 1 (rad),joint 2 [rad],joint_3_rad", *RAD)), None),
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
        ("a,b,c\n0,-60,40\n20,-75,50\n", "does not name.*joint 1,joint 2,joint 3"),
        ("time,shoulder,elbow\n0,-60,40\n1,-75,50\n", "does not name"),
        ("joint 1,joint 2,joint 2\n0,-60,40\n1,-75,50\n", "line 1: two columns are called 'joint2'"),
        ("joint 1,j2,joint 2,joint 3\n0,-60,1,40\n1,-75,1,50\n", "'j2' and 'joint 2' both name joint 2"),
        ("j1 (gon),j2,j3\n0,-60,40\n1,-75,50\n", "'j1 \\(gon\\)': the unit is not known"),
        (
            "j1,j2,j3,j4\n0,-60,40,0\n20,-75,50,9\n",
            "line 3: joint 4 at 9 degrees has no motor, it stays at 0",
        ),
        ("joint 1;joint 2;joint 3\n0;-60;40\n1;2\n", "line 3: 2 values"),
        ("time_s,joint 1,joint 2,joint 3\n1,0,-60,40\n1,20,-75,50\n", "line 3: the time does not increase"),
        ("\n".join(RAD), "no angle is beyond 1.31: degrees or radians.*--radians"),
        ("\n".join(("j1,j2,j3", *RAD)), "degrees or radians"),
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


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [1.0, 0.1, 0.01])
def test_an_exported_motion_comes_back_thinned_to_the_tolerance(tmp_path: Path, tolerance: float) -> None:
    plan = shipped_plan()
    table = tmp_path / "feed.csv"
    table.write_text(plan.to_csv(60.0))
    found = via_table.read(table, ARM, tolerance_deg=tolerance)
    assert found.lines == 409
    assert found.thinned_to_deg is not None
    assert found.thinned_to_deg <= tolerance
    assert 5 < len(found.via_deg) < {1.0: 15, 0.1: 40, 0.01: 100}[tolerance]
    times = exchange.times_s(plan.trajectory.duration_s, 60.0)
    assert apart_deg(spline_deg(found.via_deg), plan.trajectory(times)) <= found.thinned_to_deg + 1e-3


def spline_deg(via_deg: np.ndarray) -> np.ndarray:
    """Points of the spline that is planned through via points, dense."""
    return bspline.Spline.through(via_deg)(np.linspace(0.0, len(via_deg) - 1.0, 100 * len(via_deg)))


def apart_deg(one: np.ndarray, other: np.ndarray) -> float:
    """Largest distance of a point of either path from the other one, the largest over the joints."""

    def away(points: np.ndarray, path: np.ndarray) -> float:
        parts = max(2, 200_000 // len(path))
        fine = np.linspace(0.0, len(path) - 1.0, parts * len(path))
        dense = np.stack([np.interp(fine, np.arange(len(path)), column) for column in path.T], axis=1)
        return float(cKDTree(dense).query(points, p=np.inf)[0].max())

    return max(away(one, other), away(other, one))


@pytest.mark.long
@pytest.mark.parametrize(
    "rows",
    [
        [(0, -60, 40), (2, -60, 40), (90, -60, 40), (92, -60, 40), (100, -60, 40)],
        [(0, -60, 40), (2, -60, 40)],
        [(0, -60, 40), (30, -100, 0), (30.5, -99, 0), (0, -60, 40)],
        [(-10, -60, 40), (-10, -150, 60), (190, 10, 100)],
    ],
)
def test_what_is_planned_keeps_the_tolerance(rows: list[tuple[float, float, float]]) -> None:
    """Of uneven via points, which a spline on uneven knots follows and that on even ones does not."""
    points = np.array(rows, dtype=float)
    found = thinning.thinned(points, 0.1, ranges_deg=np.array([joint.range_deg for joint in ARM.driven]))
    job = Job("again", via_deg=found.via_deg.tolist())
    plan = planner.plan(ARM, replace(job, refine=1, starts=1, polish=False, iterations=5))
    moved = plan.trajectory(np.linspace(0.0, plan.trajectory.duration_s, 1500))
    assert apart_deg(moved, points) <= found.off_deg + 0.02 <= 0.12


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
def test_rests_of_a_recording_are_kept_as_stops(tmp_path: Path) -> None:
    """A motion, a second of rest, and a motion back another way, with rests around and noise of an encoder."""
    there = point_to_point.straight("there", (0, -60, 40), (40, -90, 20), ARM)
    back = point_to_point.straight("back", (40, -90, 20), (10, -60, 60), ARM)
    times = np.arange(0.0, 3.0 + there.duration_s + back.duration_s, 0.01)
    angles = np.where(
        times[:, None] < 1.5 + there.duration_s, there(times - 0.5), back(times - 1.5 - there.duration_s)
    )
    rng = np.random.default_rng(7)
    noisy = angles + rng.uniform(-0.004, 0.004, angles.shape)
    table = tmp_path / "recorded.csv"
    rows = "".join(
        f"{time},{','.join(map(str, row))}\n" for time, row in zip(times, noisy.tolist(), strict=True)
    )
    table.write_text(f"time,j1,j2,j3\n{rows}")
    found = via_table.read(table, ARM)
    (rest,) = found.rests_s
    assert found.rests_s[rest] == pytest.approx(1.0, abs=0.15)
    assert "rest at the beginning" in found.notes[0]
    job = Job.from_csv(table, ARM)
    assert [stop.via for stop in job.stops] == [rest]
    plan = planner.plan(ARM, replace(job, refine=1))
    assert problems.faults(plan) == []
    begins_s = plan.trajectory.joints[0].via_times_s[rest]
    during = plan.trajectory(np.linspace(begins_s, begins_s + found.rests_s[rest], 50))
    assert np.ptp(during, axis=0).max() < 1e-6
    moved = plan.trajectory(np.linspace(0.0, plan.trajectory.duration_s, 2000))
    assert apart_deg(moved, noisy) <= 0.1


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
def test_the_bound_of_thinning_holds(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = np.cumsum(rng.normal(size=(12, 3)) * rng.choice([1.0, 20.0], (12, 1)), axis=0)
    found = thinning.thinned(points, 0.5)
    away = apart_deg(spline_deg(found.via_deg), points)
    assert away <= found.off_deg + 0.02, f"seed {seed}"


def test_a_path_without_times_is_thinned_where_asked(tmp_path: Path) -> None:
    table = tmp_path / "arc.csv"
    turn = np.linspace(0.0, np.pi, 600)
    table.write_text(
        "".join(f"{50 + 20 * np.cos(a)},{-60 + 20 * np.sin(a)},40\n" for a in np.repeat(turn, 2))
    )
    assert len(via_table.read(table, ARM).via_deg) == 1200
    found = via_table.read(table, ARM, tolerance_deg=0.1)
    assert 3 < len(found.via_deg) < 25
    np.testing.assert_allclose(found.via_deg[[0, -1]], [[70, -60, 40], [30, -60, 40]], atol=1e-9)


@pytest.mark.parametrize("tolerance", [0.0, -1.0, float("nan"), 91.0])
def test_an_impossible_tolerance_is_refused(tolerance: float) -> None:
    with pytest.raises(InputError, match=r"a tolerance of .* is not allowed"):
        thinning.thinned(np.zeros((3, 2)), tolerance)


def test_what_cannot_be_thinned_to_a_motion_is_refused() -> None:
    noise = np.random.default_rng(12).normal(size=(700, 3))
    with pytest.raises(InputError, match=r"more than 513 via points are needed"):
        thinning.thinned(noise, 0.001, np.arange(700.0))


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
