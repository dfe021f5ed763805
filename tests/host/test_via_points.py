"""Via points from poses: which posture reaches them, and notes on what the user must know."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from armtempo.basics.errors import InputError, PlanError
from armtempo.cli import main
from armtempo.kinematics import Geometry, forward
from armtempo.model import shipped
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.plan import Plan
from armtempo.model.pose import from_rpy
from armtempo.model.tool_pose import Pose
from armtempo.planning import planner, via_points
from click.testing import CliRunner

from tests.host.arms import FOUR, asked

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


@pytest.mark.slow
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


def test_a_long_way_round_is_said() -> None:
    wide = replace(ARM, joints=(replace(ARM.joints[0], range_deg=(-400.0, 400.0)), *ARM.joints[1:]))
    job = Job("round", via_deg=[(350.0, -60.0, 40.0), (10.0, -60.0, 40.0)])
    (note,) = planner.via_angles(wide, job)[1]
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
