"""Sliding joints: kinematics and forces by independent formulas, and units that are never taken for others."""

from __future__ import annotations

import math
import re
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import armtempo
import numpy as np
import pytest
from armtempo.basics import toml_table
from armtempo.basics.errors import InputError, PlanError
from armtempo.encoding import encode
from armtempo.kinematics import Geometry, forward
from armtempo.kinematics.chain import outline_mm
from armtempo.kinematics.dynamics import GRAVITY_M_S2, joint_torques, per_rad
from armtempo.kinematics.forward import all_frames
from armtempo.kinematics.solver import PoseSolver
from armtempo.model import via_table
from armtempo.model.arm import Arm
from armtempo.model.arm_json import load as load_arm
from armtempo.model.arm_json import save as save_arm
from armtempo.model.job import Job
from armtempo.model.joint_trajectory import of_text
from armtempo.model.joint_unit import PRISMATIC
from armtempo.model.parts import Dynamics, Joint, JointModel, Limits, Motor
from armtempo.model.plan import Plan
from armtempo.planning import planner, point_to_point, sequence_planner, torque, via_points, workspace_check
from armtempo.planning.jog import jog_motion
from armtempo.planning.jog.jog_motion import JogMove, move_of
from armtempo.planning.tool import Tool
from armtempo.simulator.launch_options import describe

from tests.host.arms import SIX, SLIDE_AND_TURN

SEED = 20_261_127
TOLERANCE = 1e-9
QUICK: dict[str, Any] = {"path": "through", "optimiser": "gradient", "starts": 1, "refine": 2}
SCARA, RAIL = Arm.load("scara_z"), Arm.load("community_rail")


def arm_of(text: str) -> Arm:
    return Arm.of_table(toml_table.parse(text, "arm.toml"))


LIFT = arm_of(SLIDE_AND_TURN)


def drawn(rng: np.random.Generator, sliding: str) -> Arm:
    """An arm of random rows; ``sliding``: a letter for each, s of one that slides."""
    joints = []
    for number, letter in enumerate(sliding, 1):
        slides = letter == "s"
        motor = Motor(number, 200, 16, 1.0, mm_per_rev=8.0 if slides else None)
        d, a = rng.uniform(-150.0, 150.0, 2)
        ends = (-120.0, 200.0) if slides else (-150.0, 170.0)
        joints.append(
            Joint(
                f"j{number}", d, a, rng.uniform(-180, 180), rng.uniform(-180, 180), ends,
                limits=Limits(50.0, 100.0, 1000.0), motor=motor, type=PRISMATIC if slides else "revolute",
            )
        )  # fmt: skip
    return Arm(sliding, tuple(joints))


def product(arm: Arm, at: np.ndarray) -> np.ndarray:
    """The pose as the product of the four elementary transforms of each row."""
    pose = np.eye(4)
    for joint, value in zip(arm.joints, at, strict=True):
        theta = math.radians(joint.theta_offset_deg + (0.0 if joint.slides else value))
        turn, lift, along, twist = np.eye(4), np.eye(4), np.eye(4), np.eye(4)
        turn[:2, :2] = [[math.cos(theta), -math.sin(theta)], [math.sin(theta), math.cos(theta)]]
        lift[2, 3] = joint.d_mm + (value if joint.slides else 0.0)
        along[0, 3] = joint.a_mm
        alpha = math.radians(joint.alpha_deg)
        twist[1:3, 1:3] = [[math.cos(alpha), -math.sin(alpha)], [math.sin(alpha), math.cos(alpha)]]
        pose = pose @ turn @ lift @ along @ twist
    return pose


def postures(rng: np.random.Generator, arm: Arm, count: int) -> np.ndarray:
    low, high = np.array([joint.range_deg for joint in arm.joints]).T
    return rng.uniform(low, high, (count, len(low)))


@pytest.mark.parametrize("sliding", ["srrr", "rsr", "sss", "srrsrr"])
def test_poses_derivatives_and_postures_are_those_of_the_product_of_transforms(sliding: str) -> None:
    print("seed", SEED)
    rng = np.random.default_rng(SEED)
    arm = drawn(rng, sliding)
    at = postures(rng, arm, 20)
    poses = np.array([product(arm, each) for each in at])
    found = armtempo.forward(arm, at)
    np.testing.assert_allclose(found, poses, atol=TOLERANCE)
    np.testing.assert_allclose(armtempo.forward(arm, at[0]), poses[0], atol=TOLERANCE)
    geometry = Geometry.of(arm)
    np.testing.assert_allclose(outline_mm(arm, at)[:, -1], poses[:, :3, 3], atol=TOLERANCE)
    np.testing.assert_allclose(all_frames(geometry, np.radians(at[0]).tolist())[-1], poses[0], atol=TOLERANCE)

    tool = Tool(arm, list(range(len(at[0]))), at[0])
    state, step = tool.at(at), 1e-4
    assert np.all(np.abs(poses[:, :3, 3]) <= geometry.reach + abs(arm.joints[0].d_mm))
    for joint in range(len(at[0])):
        moved = step * np.eye(len(at[0]))[joint]
        ahead, behind = (np.array([product(arm, each + way) for each in at]) for way in (moved, -moved))
        slope = (ahead - behind)[:, :3, 3] / (2.0 * step)
        np.testing.assert_allclose(state.slope_mm_deg[:, :, joint], slope, atol=1e-6)
        reach = math.radians(1.0) * tool.reach_mm[joint]
        assert np.linalg.norm(slope, axis=1).max() <= reach * (1.0 + 1e-9)
    rate, bend = rng.uniform(-1.0, 1.0, (2, *at.shape))
    first, second = tool.moved(at, rate, bend)
    steps = [-1e-3, 0.0, 1e-3]
    path = [
        np.array([product(arm, each) for each in at + u * rate + 0.5 * u * u * bend])[:, :3, 3] for u in steps
    ]
    np.testing.assert_allclose(first, (path[2] - path[0]) / 2e-3, atol=1e-4)
    np.testing.assert_allclose(second, (path[2] - 2.0 * path[1] + path[0]) / 1e-6, atol=1e-3)

    solver = PoseSolver(arm)
    for pose in poses[:1]:
        answer = solver.solve(armtempo.Pose.of_matrix(pose, ()), solver.home_rad)
        assert answer.success, answer.reason
        np.testing.assert_allclose(product(arm, np.array(answer.angles_deg))[:3, 3], pose[:3, 3], atol=0.1)
        for joint, position in zip(arm.joints, answer.angles_deg, strict=True):
            assert joint.range_deg[0] <= position <= joint.range_deg[1]  # no turn is added to a position


def test_bounds_of_second_derivatives_hold_for_a_slide_beyond_short_links() -> None:
    """The turn of an inner joint turns the direction of a slide, however short the links are."""
    rng = np.random.default_rng(SEED)
    arm = drawn(rng, "rs")
    joints = [replace(joint, d_mm=0.0, a_mm=0.0, alpha_deg=90.0) for joint in arm.joints]
    joints[1] = replace(joints[1], range_deg=(0.0, 1.0))
    arm = replace(arm, joints=tuple(joints))
    tool = Tool(arm, [0, 1], np.zeros(2))
    rate = np.radians(np.ones((1, 2)) * math.degrees(1.0))  # a radian of both
    _, second = tool.moved(np.array([[10.0, 0.5]]), np.degrees(rate), np.zeros((1, 2)))
    outer = np.minimum(tool.reach_mm[:, None], tool.reach_mm[None, :])
    assert np.linalg.norm(second) <= outer.sum() * (1.0 + 1e-9)


def test_a_locked_slide_under_an_arm_leaves_its_closed_form() -> None:
    paper = Arm.paper()
    lift = Joint("lift", 40.0, 30.0, 20.0, 10.0, (59.999, 60.001), 60.0, type=PRISMATIC)
    arm = replace(paper, joints=(lift, *paper.joints))
    at = np.array([60.0, 20.0, -50.0, 30.0, 40.0, 50.0, -60.0])
    pose = product(arm, at)
    found = armtempo.inverse(arm, pose, at)
    assert len(found) == 8
    np.testing.assert_allclose(found[0].angles_deg, at, atol=1e-9)


def test_an_arm_on_a_rail_has_its_closed_form_where_the_rail_stands() -> None:
    """Else it is searched for, and the rail moves."""
    foot = Joint("foot", 0.0, 0.0, -90.0, 0.0, (-0.001, 0.001))
    drive = {"limits": Limits(100.0, 100.0, 1000.0), "motor": Motor(1, 200, 16, 1.0, mm_per_rev=40.0)}
    rail = Joint("rail", 0.0, 0.0, 90.0, 0.0, (-900.0, 900.0), type=PRISMATIC, **drive)  # type: ignore[arg-type]
    arm = replace(SIX, joints=(foot, rail, *SIX.joints))
    solver = PoseSolver(arm)
    assert solver.refusals == []
    at = np.array([0.0, 520.0, 20.0, -50.0, 30.0, 40.0, 50.0, -60.0])
    pose = product(arm, at)
    found = armtempo.inverse(arm, pose, at + 5.0 * np.eye(8)[2])
    assert len(found) == 8
    np.testing.assert_allclose(found[0].angles_deg, at, atol=1e-9)
    assert {solution.angles_deg[1] for solution in found} == {520.0}
    for solution in found:
        np.testing.assert_allclose(product(arm, solution.angles_deg), pose, atol=1e-9)
    near = solver.nearest(armtempo.Pose.of_matrix(pose), np.radians(at + 1.0))
    assert near.method == "closed form"
    assert near.angles_deg[1] == pytest.approx(521.0)
    far = solver.solve(armtempo.Pose.of_matrix(pose), np.radians(at - 1400.0 * np.eye(8)[1]))
    assert far.success
    assert far.angles_deg[1] > -300.0
    np.testing.assert_allclose(product(arm, np.array(far.angles_deg))[:3, 3], pose[:3, 3], atol=0.1)
    # the next via point keeps the rail of the one before
    given = tuple(at[1:])
    job = Job("a", via=(given, armtempo.Pose.of_matrix(product(arm, at + 9.0 * np.eye(8)[2]))))
    via = via_points.resolve(arm, job).via_deg
    np.testing.assert_allclose(via[1], given + 9.0 * np.eye(7)[1], atol=1e-9)


def test_forces_are_those_of_a_turning_slide() -> None:
    """A mass on an arm that turns and slides: polar coordinates, as in any textbook; and one that is lifted."""
    rng = np.random.default_rng(SEED)
    mass = 1.7
    turn = Joint("turn", 0.0, 0.0, 90.0, 90.0, (-180.0, 180.0))  # the next z axis lies in the plane
    slide = Joint(
        "slide", 100.0, 0.0, 0.0, 0.0, (0.0, 300.0), type=PRISMATIC,
        dynamics=Dynamics(mass, friction_nm=3.0, viscous_nm_s=2.0),
    )  # fmt: skip
    arm = Arm("polar", (turn, slide))
    q, v, a = rng.uniform(-2.0, 2.0, (3, 40, 2))
    scale = per_rad(arm)[1]
    found = joint_torques(arm, q, v, a)
    r, dr, ddr = 0.1 + scale * q[:, 1], scale * v[:, 1], scale * a[:, 1]
    w, dw = v[:, 0], a[:, 0]
    np.testing.assert_allclose(found[:, 0], mass * (r * r * dw + 2.0 * r * dr * w), atol=TOLERANCE)
    force = mass * (ddr - r * w * w) + 3.0 * np.sign(dr) + 2.0 * dr
    np.testing.assert_allclose(found[:, 1], force, atol=TOLERANCE)

    lifted = replace(LIFT.joints[0], dynamics=Dynamics(mass))
    arm = replace(LIFT, joints=(lifted, replace(LIFT.joints[1], dynamics=Dynamics(0.0))))
    motion = point_to_point.straight("up", (0.0, 0.0), (100.0, 0.0), arm)
    needed = torque.of_motion(arm, motion)
    assert needed is not None
    up = 1e-3 * motion(needed.times_s, 2)[:, 0]
    lead_m = 8e-3 / (2.0 * math.pi)  # of a radian of the shaft
    np.testing.assert_allclose(needed.needed_nm[:, 0], mass * (GRAVITY_M_S2 + up) * lead_m, atol=TOLERANCE)


def test_a_gantry_as_the_page_has_it_moves_two_belts_by_sum_and_difference() -> None:
    page = (Path(__file__).parents[2] / "host" / "docs" / "arms.md").read_text(encoding="utf-8")
    rows, coupling = re.findall(r"```toml\n(.*?)```", page.split("### Rails and gantries")[1], re.DOTALL)[:2]
    numbers = iter("123")
    drive = "limits = {{ speed_mm_s = 100, acceleration_mm_s2 = 500, jerk_mm_s3 = 5000 }}\nmotor = {{ channel = {}, "
    drive += "steps_per_rev = 200, microsteps = 16, mm_per_rev = 40 }}\n"
    rows = re.sub(r"(?m)^range_mm.*\n", lambda found: found[0] + drive.format(next(numbers)), rows)
    gantry = arm_of(f'name = "gantry"\n{rows}\n{coupling}')
    assert gantry.texts.units == "mm"
    at = [100.0, 50.0, -20.0]
    pose = armtempo.forward(gantry, at)
    np.testing.assert_allclose(pose[:3], np.column_stack([np.eye(3), at]), atol=TOLERANCE)
    np.testing.assert_allclose(gantry.transmission.steps(at), 80.0 * np.array([150.0, 50.0, -20.0]))
    (found,) = armtempo.inverse(gantry, armtempo.Pose.of_matrix(pose, ()))
    np.testing.assert_allclose(found.angles_deg[1:], at, atol=1e-6)
    moved = jog_motion.plan("j", gantry, at, JogMove(30.0, axis="x"))
    np.testing.assert_allclose(moved.end_deg, [130.0, 50.0, -20.0], atol=1e-3)


def test_the_virtual_arm_gets_a_mass_and_a_force_as_their_turning_equals() -> None:
    model = JointModel(holding_torque_nm=0.4, inertia_kg_m2=2.0, gravity_torque_nm=20.0)
    joints = (replace(LIFT.joints[0], model=model), LIFT.joints[1])
    drive = describe(replace(LIFT, joints=joints))["joints"][0]
    at_motor = drive["model"]["gravity_torque_nm"] / drive["gear_ratio"]
    assert at_motor == pytest.approx(20.0 * 8e-3 / (2.0 * math.pi))
    inertia = drive["model"]["inertia_kg_m2"] / drive["gear_ratio"] ** 2
    assert inertia == pytest.approx(2.0 * (8e-3 / (2.0 * math.pi)) ** 2)
    assert drive["slides"]


def test_steps_counts_and_limits_are_those_of_the_screw() -> None:
    joint = LIFT.driven[0]
    assert joint.steps_per_deg == 100.0  # a mm
    assert joint.counts_per_deg == 250.0
    assert joint.limits.values == (40.0, 200.0, 2000.0)
    row = encode.motor_rows(LIFT)[0]
    assert (row["min_steps"], row["max_steps"], row["following_counts"]) == (0, 20_000, 500)
    assert row["max_rate"] == encode.with_margin(4000.0)
    geared = arm_of(SLIDE_AND_TURN.replace("mm_per_rev = 8.0", "mm_per_rev = 8.0, gear_ratio = 3.0"))
    assert geared.driven[0].steps_per_deg == 300.0


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("range_mm", "range_deg", ["joint[1].range_deg is of a turning joint, and this one slides", "range_mm"]),
        ("speed_mm_s", "speed_deg_s", ["joint[1].limits.speed_deg_s is of a turning joint", "speed_mm_s"]),
        ("following_error_mm", "following_error_deg", ["encoder.following_error_deg is of a turning joint"]),
        ('type = "prismatic"\n', "", ["joint[1].range_mm is of a sliding joint, and this one turns", "prismatic"]),
        ("prismatic", "sliding", ["joint[1].type = 'sliding' is not allowed", "'prismatic'"]),
        (", mm_per_rev = 8.0", "", ["joint[1].motor.mm_per_rev is missing"]),
        ("mm_per_rev = 8.0", "mm_per_rev = 0.0", ["mm_per_rev = 0.0 is not allowed", "0.01"]),
        ("gear_ratio = 20.0", "gear_ratio = 20.0, mm_per_rev = 8.0", ["motor.mm_per_rev is of a sliding joint"]),
        ("range_mm = [0.0, 200.0]", "range_mm = [200.0, 0.0]", ["two positions in mm, the smaller first"]),
        ("range_deg = [-90.0, 90.0]", "range_deg = [-90.0, 90.0]\nparallel_linkage = true", ["z before it slides"]),
        ("a_mm = 100.0", "a_mm = 100.0\nparallel_linkage = true", ["parallel_linkage"]),
        ("a_mm = 100.0", "a_mm = 100.0\nmodel = { inertia_kg_m2 = 1.0 }", ["model.inertia_kg_m2", "moved_kg"]),
        ("a_mm = 100.0", "a_mm = 100.0\ndynamics = { mass_kg = 0.0, friction_nm = 1.0 }", ["friction_n"]),
    ],
)  # fmt: skip
def test_a_wrong_unit_in_an_arm_file_is_said(old: str, new: str, said: list[str]) -> None:
    assert old in SLIDE_AND_TURN
    with pytest.raises(InputError) as error:
        arm_of(SLIDE_AND_TURN.replace(old, new, 1))
    for words in said:
        assert words in str(error.value)


def test_lists_of_positions_say_nothing_of_degrees() -> None:
    """angles_deg, via_deg and posture_deg cannot say where a sliding joint is; the neutral keys serve every arm."""
    neutral = 'name = "a"\nvia_joints = [[0.0, 1.0], [150.0, 2.0]]\n'
    assert Job.of_table(toml_table.parse(neutral, "a"), LIFT).via == ((0.0, 1.0), (150.0, 2.0))
    tables = 'name = "a"\n[[via]]\njoints = [0.0, 1.0]\n[[via]]\njoints = [150.0, 2.0]\n'
    assert Job.of_table(toml_table.parse(tables, "a"), LIFT).via == ((0.0, 1.0), (150.0, 2.0))
    for text, key in ((neutral, "via_deg"), (tables, "angles_deg")):
        degrees = text.replace("via_joints", key).replace("joints", key)
        with pytest.raises(InputError, match=f"{key}: z slides, so a list in degrees") as error:
            Job.of_table(toml_table.parse(degrees, "a"), LIFT)
        assert "z in mm, turn in deg" in str(error.value)
    two = Arm("two", tuple(replace(LIFT.joints[1], name=name, motor=replace(LIFT.joints[1].motor, channel=number))
                           for number, name in enumerate("ab", 1)))  # type: ignore[type-var]  # fmt: skip
    turning = neutral.replace("150.0", "15.0")
    assert Job.of_table(toml_table.parse(turning, "a"), two).via == ((0.0, 1.0), (15.0, 2.0))
    both = turning + "via_deg = [[0.0, 1.0], [15.0, 2.0]]\n"
    with pytest.raises(InputError, match="leave it out beside via_deg"):
        Job.of_table(toml_table.parse(both, "a"), two)
    with pytest.raises(InputError, match="within the range of z, 0 to 200 mm"):
        Job.of_table(toml_table.parse(neutral.replace("150.0", "250.0"), "a"), LIFT)
    posture = SLIDE_AND_TURN.replace(
        'name = "lift"', 'name = "lift"\nposture.up = { joints = [150.0, 10.0] }'
    )
    assert arm_of(posture).posture("up").where == (150.0, 10.0)
    with pytest.raises(InputError, match=r"posture\.up\.angles_deg: z slides, so"):
        arm_of(posture.replace("joints = [150", "angles_deg = [150"))
    with pytest.raises(InputError, match="corridor_deg is of arms whose joints all turn"):
        planner.plan(LIFT, Job("a", via=((0.0, 0.0), (100.0, 10.0)), corridor_deg=1.0))


@pytest.mark.slow
def test_a_motion_keeps_its_limits_and_goes_out_and_in_with_its_units(tmp_path: Path) -> None:
    plan = planner.plan(LIFT, Job("a", via=((0.0, 0.0), (150.0, 60.0), (20.0, -30.0)), **QUICK))
    most = plan.extremes[0].values
    assert np.all(most <= np.array([40.0, 200.0, 2000.0]) * (1 + 1e-6))
    assert max(most / [40.0, 200.0, 2000.0]) > 0.99
    plan.save(tmp_path / "a.json")
    assert Plan.load(tmp_path / "a.json").arm == LIFT
    save_arm(LIFT, tmp_path / "arm.json")
    assert load_arm(tmp_path / "arm.json") == LIFT
    text = plan.to_csv(50.0)
    assert text.startswith("time_s,j1_position_mm,j1_speed_mm_s,")
    job = tomllib.loads(via_table.job_text("a", via_table.of_text(text, "a.csv", LIFT)))
    np.testing.assert_allclose(job["via_joints"][0], [0.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(job["via_joints"][-1], [20.0, -30.0], atol=1e-9)
    fine = via_table.of_text(text, "a.csv", LIFT, tolerance_deg=0.02)
    coarse = via_table.of_text(text, "a.csv", LIFT, tolerance_deg=[2.0, 0.02])
    assert len(coarse.via_deg) <= len(fine.via_deg)
    (off_mm, off_deg) = map(float, re.findall(r"([\d.e-]+) (?:mm|deg)", coarse.thinned_to))
    assert (off_mm, off_deg) == pytest.approx((100.0 * off_deg, off_deg), rel=0.1)
    assert off_deg <= 0.02 < off_mm <= 2.0
    assert fine.thinned_to.endswith(" mm or deg")
    recorded = of_text(plan.to_ros(20.0), "a.yaml", LIFT)
    np.testing.assert_allclose(recorded.angles_deg[-1], [20.0, -30.0], atol=1e-9)
    assert float(re.findall(r"- positions: \[([^,]+)", plan.to_ros(20.0))[-1]) == pytest.approx(0.02)  # m
    metres = via_table.of_text("z (m),turn (rad)\n0,0\n0.15,1\n", "a.csv", LIFT)
    np.testing.assert_allclose(metres.via_deg[1], [150.0, math.degrees(1.0)])
    for head, said in (
        ("z,turn (deg)", "the column of z, which slides, does not say its unit"),
        ("z (deg),turn (deg)", "the unit is not known"),
    ):
        with pytest.raises(InputError, match=said):
            via_table.of_text(f"{head}\n0,0\n15,1\n", "a.csv", LIFT)
    with pytest.raises(InputError, match="no header says in which units"):
        via_table.of_text("0,0\n15,1\n", "a.csv", LIFT)


def test_a_sequence_says_where_a_slide_is_in_mm() -> None:
    job = Job("a", via=((50.0, 10.0), (60.0, 20.0)), **QUICK)
    steps = [armtempo.Goto((0.0, 0.0)), armtempo.RunMotion(planner.plan(LIFT, job))]
    with pytest.raises(InputError, match=r"a begins at 50 mm, 10°, but the arm is at 0 mm, 0°"):
        sequence_planner.plan(LIFT, armtempo.Sequence("s", steps))


def test_jogs_move_a_slide_by_mm_and_the_tool_along_it() -> None:
    assert move_of(LIFT, "z", None, None, 5.0).unit(LIFT) == "mm"
    with pytest.raises(InputError, match="z slides: it moves by mm, not by degrees"):
        move_of(LIFT, "z", None, 5.0, None)
    here = (100.0, 10.0)
    np.testing.assert_allclose(jog_motion.plan("j", LIFT, here, JogMove(5.0, joint=0)).end_deg, [105.0, 10.0])
    end = jog_motion.plan("j", LIFT, here, JogMove(500.0, joint=0))
    assert end.ends == "z is at the end of its range, 200 mm"
    lifted = jog_motion.plan("j", SCARA, (50.0, 20.0, 60.0, 0.0), JogMove(30.0, axis="z"))
    np.testing.assert_allclose(lifted.end_deg, [80.0, 20.0, 60.0, 0.0], atol=1e-3)
    aside = jog_motion.plan("j", RAIL, (0.0, 0.0, 10.0, 100.0), JogMove(20.0, axis="y"))
    moved = forward(Geometry.of(RAIL), np.radians([0.0, *aside.end_deg, 0.0]))[:3, 3]
    at = forward(Geometry.of(RAIL), np.radians([0.0, 0.0, 0.0, 10.0, 100.0, 0.0]))[:3, 3]
    np.testing.assert_allclose(moved - at, [0.0, 20.0, 0.0], atol=0.1)


def test_a_slide_into_a_box_is_seen_between_samples() -> None:
    """The proof bounds how fast a slide carries its links, and that its own link grows."""
    box = (
        '\n[workspace]\nkeep_out = [{ name = "shelf", low_mm = [80, -40, 150], high_mm = [120, 40, 152] }]\n'
    )
    arm = arm_of(SLIDE_AND_TURN + box)
    bodies = workspace_check.Bodies(arm)
    rng = np.random.default_rng(SEED)
    here = np.column_stack([rng.uniform(0, 200, 200), rng.uniform(-90, 90, 200)])
    way = rng.uniform(-1.0, 1.0, (200, 2))
    shrink = bodies.distances(here) - bodies.distances(here + 1e-3 * way)
    allowed = np.array([bodies.speeds_mm_s(np.abs(each)) for each in way]) * 1e-3
    assert np.all(shrink <= allowed + 1e-9)
    with pytest.raises(PlanError, match=r"the link of z is .* inside of shelf"):
        planner.plan(arm, Job("a", via=((10.0, 0.0), (190.0, 0.0)), **QUICK))
    planner.plan(arm, Job("a", via=((10.0, 0.0), (100.0, 0.0)), **QUICK))


@pytest.mark.slow
def test_a_line_is_followed_with_a_slide() -> None:
    start, end = (20.0, 20.0, 60.0, 0.0), (90.0, 50.0, 40.0, 0.0)
    poses = [armtempo.forward(SCARA, at) for at in (start, end)]
    places = [pose[:3, 3].tolist() for pose in poses]
    line = f"position_mm = {places[1]}\nline = true\ntolerance_mm = 2"
    text = f'name = "a"\nrefine = 1\n[[via]]\njoints = {list(start)}\n[[via]]\n{line}\n'
    plan = planner.plan(SCARA, Job.of_table(toml_table.parse(text, "a"), SCARA))
    path = armtempo.forward(SCARA, plan.trajectory(np.linspace(0.0, plan.total_s, 200)))[:, :3, 3]
    way = poses[1][:3, 3] - poses[0][:3, 3]
    way /= np.linalg.norm(way)
    off = path - poses[0][:3, 3]
    assert np.linalg.norm(off - np.outer(off @ way, way), axis=1).max() < 2.0
    np.testing.assert_allclose(path[-1], places[1], atol=0.1)
