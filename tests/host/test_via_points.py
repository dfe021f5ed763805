"""Via points: from poses, with notes on what the user must know, and from and to tables of other programs."""

from __future__ import annotations

import csv
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from armtempo.basics import number_table
from armtempo.basics.errors import InputError, PlanError
from armtempo.cli import main
from armtempo.kinematics import Geometry, forward
from armtempo.model import exchange, shipped, via_table
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.plan import Plan
from armtempo.model.pose import from_rpy
from armtempo.model.tool_pose import Pose
from armtempo.planning import planner, via_points
from click.testing import CliRunner
from scipy.interpolate import CubicSpline

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


def test_the_start_is_there_at_any_rate() -> None:
    assert exchange.times_s(7.0, 1e-300).tolist() == [0.0, 7.0]


@pytest.mark.parametrize("rate", [0.0, -1.0, float("nan"), 1e9])
def test_an_impossible_rate_is_refused(rate: float) -> None:
    with pytest.raises(InputError, match="not allowed"):
        exchange.times_s(1.0, rate)


@pytest.mark.parametrize(
    ("text", "radians"),
    [
        ("0,-60,40\n20,-75,50\n", False),
        ("a,b,c\n0,-60,40\n\n20,-75,50\n", False),
        ("joint 3,joint 1,joint 2\n40,0,-60\n50,20,-75\n", False),
        ("time_s,j1_angle_deg,j2_angle_deg,j3_angle_deg\n8,0,-60,40\n9,20,-75,50\n", False),
        ("0;-60;40\n20;-75;50\n", False),
        ("joint 1;joint 2;joint 3\n0,0;-60,0;40,0\n20,0;-75,0;50,0\n", False),
        ("0\t-60\t40\n20\t-75\t50\n", False),
        ("\ufeffa\tb\tc\r\n0\t-60\t4e1\r\n20\t-75\t50\r\n", False),
        ("0,-1.0471975511965976,0.6981317007977318\n0.349065850,-1.308996939,0.872664626\n", True),
    ],
)
def test_via_points_come_from_any_sensible_table(tmp_path: Path, text: str, radians: bool) -> None:
    table = tmp_path / "via.csv"
    table.write_text(text, encoding="utf-8")
    np.testing.assert_allclose(
        via_table.via_points(number_table.read(table), ARM, radians).via_deg,
        [[0, -60, 40], [20, -75, 50]],
        atol=1e-6,
    )


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "0 via points"),
        ("0,-60,40\n", "1 via points"),
        ("0,-60,40\n20,-75\n", "line 2: 2 values"),
        ("0,-60,40\n20,x,50\n", "line 2: 'x' is not a finite number"),
        ("0,-60,40\n20,nan,50\n", "line 2: 'nan'"),
        ("0,-60,inf\n20,-75,50\n", "line 1: 'inf'"),
        ("joint 1,joint 2\n1,2\n", "line 1: the header does not name"),
        ("joint 1;joint 2;joint 3\n0;-60;40\n1;2\n", "line 3: 2 values"),
        ("time_s,joint 1,joint 2,joint 3\n1,0,-60,40\n1,20,-75,50\n", "line 3: time_s does not increase"),
        ("header:\n  stamp: {sec: 0, nanosec: 0}\n", "is a ROS message, not a table; export"),
    ],
)
def test_a_table_that_will_not_do_is_refused_with_its_line(tmp_path: Path, text: str, said: str) -> None:
    table = tmp_path / "via.csv"
    table.write_text(text)
    with pytest.raises(InputError, match=said):
        via_table.via_points(number_table.read(table), ARM)


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [1.0, 0.1, 0.01])
def test_an_exported_motion_comes_back_thinned_to_the_tolerance(tmp_path: Path, tolerance: float) -> None:
    plan = shipped_plan()
    table = tmp_path / "feed.csv"
    table.write_text(plan.to_csv(60.0))
    found = via_table.via_points(number_table.read(table), ARM, tolerance_deg=tolerance)
    assert found.lines == 409
    assert 5 < len(found.via_deg) < {1.0: 15, 0.1: 25, 0.01: 50}[tolerance]
    times = exchange.times_s(plan.trajectory.duration_s, 60.0)
    angles = plan.trajectory(times)
    kept = [int(np.abs(angles - via).max(axis=1).argmin()) for via in found.via_deg]
    assert kept[0] == 0
    assert kept[-1] == len(times) - 1
    assert kept == sorted(kept)
    spline = CubicSpline(times[kept], found.via_deg, bc_type="clamped")
    assert np.abs(spline(times) - angles).max() <= tolerance + 1e-6


def test_a_path_without_times_is_thinned_where_asked(tmp_path: Path) -> None:
    table = tmp_path / "arc.csv"
    turn = np.linspace(0.0, np.pi, 600)
    table.write_text("".join(f"{20 * np.cos(a)},{-60 + 20 * np.sin(a)},40\n" for a in np.repeat(turn, 2)))
    assert len(via_table.via_points(number_table.read(table), ARM).via_deg) == 1200
    found = via_table.via_points(number_table.read(table), ARM, tolerance_deg=0.1)
    assert 3 < len(found.via_deg) < 25
    np.testing.assert_allclose(found.via_deg[[0, -1]], [[20, -60, 40], [-20, -60, 40]], atol=1e-9)


@pytest.mark.parametrize("tolerance", [0.0, -1.0, float("nan"), 91.0])
def test_an_impossible_tolerance_is_refused(tolerance: float) -> None:
    with pytest.raises(InputError, match=r"a tolerance of .* is not allowed"):
        via_table.thinned(np.zeros((3, 2)), tolerance)


def test_what_cannot_be_thinned_to_a_motion_is_refused() -> None:
    noise = np.random.default_rng(12).normal(size=(700, 3))
    with pytest.raises(InputError, match=r"more than 513 via points are needed"):
        via_table.thinned(noise, 0.001, np.arange(700.0))


def test_the_commands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    shipped_plan().save("feed.json")
    run = CliRunner(env={"ARMTEMPO_ARM": str(shipped.arm_path())}).invoke
    assert run(main, ["export", "feed.json", "--rate", "2", "-o", "feed.csv"]).exit_code == 0
    assert run(main, ["export", "feed.json", "--format", "ros"]).output.startswith("header:")
    made = run(main, ["import", "feed.csv", "--name", "again"])
    assert made.exit_code == 0, made.output
    assert re.match(
        r"15 lines reduced to \d+ via points: .* within 0.1 deg; 'armtempo plan' computes new times\n",
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
