"""Torque along a motion: two links by their closed form, energy over a motion, and what files, plan and report say."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from armtempo.basics.errors import InputError, PlanError
from armtempo.diagnosis.arm_check import check_arm
from armtempo.kinematics.dynamics import GRAVITY_M_S2, joint_torques
from armtempo.kinematics.of_arm import forward
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.parts import Dynamics, Joint, JointModel, Load
from armtempo.model.plan import Plan
from armtempo.planning import planner, torque
from armtempo.planning.planner import slower
from armtempo.report import run_report, text_summary

from tests.plans import changed

DATA = Path(__file__).parents[1] / "data"
SEED = 20_261_124
MASSES, LENGTHS, CENTRES, INERTIAS = (1.2, 0.7), (0.3, 0.2), (0.12, 0.11), (0.011, 0.004)


def two_links(upright: bool) -> Arm:
    """Two links that turn about parallel axes, in a vertical plane or a horizontal one."""
    base = Joint("base", 0.0, 0.0, 90.0 if upright else 0.0, 0.0, (-0.001, 0.001))
    links = [
        Joint(f"joint {number}", 0.0, 1e3 * length, 0.0, 0.0, (-180.0, 180.0), dynamics=body)
        for number, (length, body) in enumerate(zip(LENGTHS, bodies(), strict=True), 1)
    ]
    return Arm("two links", (base, *links))


def bodies() -> list[Dynamics]:
    """Links whose centres of mass are ``CENTRES`` m after their joints."""
    return [
        Dynamics(mass, (1e3 * (centre - length), 0.0, 0.0), (0.0, inertia, inertia, 0.0, 0.0, 0.0))
        for mass, length, centre, inertia in zip(MASSES, LENGTHS, CENTRES, INERTIAS, strict=True)
    ]


@pytest.mark.parametrize("upright", [True, False])
def test_two_links_need_what_their_equations_of_motion_say(upright: bool) -> None:
    """Lagrange's equations of the planar arm of two links, as in any textbook."""
    rng = np.random.default_rng(SEED)
    (q1, q2), (v1, v2), (a1, a2) = rng.uniform(-3.0, 3.0, (3, 2, 50))
    (m1, m2), (l1, _), (c1, c2), (i1, i2) = MASSES, LENGTHS, CENTRES, INERTIAS
    g = GRAVITY_M_S2 if upright else 0.0
    mixed, coriolis = m2 * l1 * c2 * np.cos(q2), m2 * l1 * c2 * np.sin(q2)
    second = i2 + m2 * c2**2
    first = i1 + m1 * c1**2 + m2 * l1**2 + second + 2.0 * mixed
    weight = m2 * c2 * g * np.cos(q1 + q2)
    needed1 = first * a1 + (second + mixed) * a2 - coriolis * (2.0 * v1 * v2 + v2**2)
    needed1 += (m1 * c1 + m2 * l1) * g * np.cos(q1) + weight
    needed2 = (second + mixed) * a1 + second * a2 + coriolis * v1**2 + weight
    zero = np.zeros_like(q1)
    found = joint_torques(
        two_links(upright), *(np.stack([zero, *each], axis=1) for each in ((q1, q2), (v1, v2), (a1, a2)))
    )
    np.testing.assert_allclose(found[:, 1:], np.stack([needed1, needed2], axis=1), atol=1e-12)


def loaded(name: str) -> Arm:
    """An arm that ships, with random bodies, friction and curves."""
    arm, rng = Arm.load(name), np.random.default_rng(SEED)
    joints = []
    for joint in arm.joints:
        shape = rng.uniform(-0.1, 0.1, (3, 3))
        tensor = shape @ shape.T
        inertia = (
            *np.diag(np.trace(tensor) * np.eye(3) - tensor),
            -tensor[0, 1],
            -tensor[0, 2],
            -tensor[1, 2],
        )
        body = Dynamics(
            rng.uniform(0.1, 2.0),
            tuple(rng.uniform(-90, 90, 3)),
            tuple(map(float, inertia)),
            *rng.uniform(0.0, 0.2, 2),
        )
        motor = joint.motor and replace(joint.motor, curve_rpm_nm=((0.0, 2.0), (500.0, 1.5), (2000.0, 0.5)))
        joints.append(replace(joint, motor=motor, dynamics=body))
    return replace(arm, joints=tuple(joints))


def energy(arm: Arm, angles: np.ndarray, step: float) -> np.ndarray:
    """Kinetic and potential energy at moments (N,) ``step`` apart: of each link as its masses on three axes."""
    total = np.zeros(len(angles))
    for number, joint in enumerate(arm.joints, 1):
        body = joint.dynamics
        assert body is not None
        poses = forward(replace(arm, joints=arm.joints[:number]), angles[:, :number])
        xx, yy, zz, xy, xz, yz = body.inertia_kg_m2
        second = 0.5 * (xx + yy + zz) * np.eye(3) - np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        values, axes = np.linalg.eigh(second)
        halves = [
            (body.mass_kg / 6.0, end * axis * np.sqrt(max(3.0 * value, 0.0) / body.mass_kg))
            for value, axis in zip(values, axes.T, strict=True)
            for end in (-1.0, 1.0)
        ]
        for mass, place in halves:
            point = poses[:, :3, 3] / 1e3 + poses[:, :3, :3] @ (np.array(body.centre_mm) / 1e3 + place)
            speed = np.gradient(point, step, axis=0)
            total += mass * (0.5 * np.sum(speed**2, axis=1) + GRAVITY_M_S2 * point[:, 2])
    return total


@pytest.mark.parametrize("name", ["ar4", "community"])
def test_power_is_the_change_of_energy_and_what_friction_takes(name: str) -> None:
    """Of the second arm parallel linkages turn joints."""
    arm = loaded(name)
    step = 1e-4
    times = step * np.arange(-3, 4)
    rng = np.random.default_rng(SEED)
    for _ in range(5):
        start, speed, change = rng.uniform(-1.5, 1.5, (3, len(arm.joints)))
        angles, rates = (
            start + times[:, None] * speed + 0.5 * times[:, None] ** 2 * change,
            speed + times[:, None] * change,
        )
        needed = joint_torques(arm, angles, rates, np.tile(change, (len(times), 1)))
        power = np.sum(needed * rates, axis=1)[3]
        body = [joint.dynamics for joint in arm.joints if joint.dynamics]
        lost = sum(b.friction_nm * abs(v) + b.viscous_nm_s * v * v for b, v in zip(body, speed, strict=True))
        change_of_energy = np.gradient(energy(arm, np.degrees(angles), step), step)[3]
        assert power - lost == pytest.approx(change_of_energy, rel=1e-5, abs=1e-5)


def test_a_load_weighs_as_a_row_of_its_own_would() -> None:
    arm = loaded("ar4")
    load = Load(
        "part", 0.7, centre_mm=(10.0, -20.0, 40.0), inertia_kg_m2=(0.02, 0.03, 0.04, 1e-3, 2e-3, 3e-3)
    )
    body = Dynamics(load.mass_kg, load.centre_mm, load.inertia_kg_m2)
    still = Joint("load", 0.0, 0.0, 0.0, 0.0, (-0.001, 0.001), dynamics=body)
    motion = np.random.default_rng(SEED).uniform(-2.0, 2.0, (3, 20, len(arm.joints)))
    found = joint_torques(replace(arm, loads=(load,)).holding("part"), *motion)
    with_row = np.concatenate([motion, np.zeros((3, 20, 1))], axis=2)
    wanted = joint_torques(replace(arm, joints=(*arm.joints, still)), *with_row)[:, :-1]
    np.testing.assert_allclose(found, wanted, atol=1e-12)


def weighty(curve: tuple[tuple[float, float], ...] = ((0.0, 0.5), (60.0, 0.4))) -> Plan:
    """A plan of the paper's arm, the masses only in joint 2's link."""
    plan = Plan.load(DATA / "trajectory_before_tolerances.json")
    joints = []
    for joint in plan.arm.joints:
        body = Dynamics(2.0, (-50.0, 0.0, 0.0)) if joint.name == "joint 2" else Dynamics(0.0)
        motor = joint.motor and replace(joint.motor, curve_rpm_nm=curve)
        joints.append(replace(joint, dynamics=body, motor=motor, model=JointModel(rotor_inertia_kg_m2=1e-4)))
    return replace(plan, arm=replace(plan.arm, joints=tuple(joints)))


def test_a_motor_needs_what_gravity_its_rotor_and_the_gear_ask() -> None:
    plan = weighty()
    found = torque.of_motion(plan.arm, plan.trajectory)
    assert found is not None
    names = [joint.name for joint in plan.arm.driven]
    gear = np.array([joint.motor.gear_ratio for joint in plan.arm.driven])
    changes = np.radians(plan.trajectory(found.times_s, 2))
    third = names.index("joint 3")  # nothing but its rotor
    np.testing.assert_allclose(found.needed_nm[:, third], 1e-4 * gear[third] * changes[:, third], atol=1e-12)
    second = names.index("joint 2")
    angles = [plan.arm.all_home_deg[0], plan.via_deg[0, second]]
    axis, link = (forward(replace(plan.arm, joints=plan.arm.joints[:n]), angles[:n]) for n in (1, 2))
    at_rest = 2.0 * GRAVITY_M_S2 * (link[0, 3] - 50.0 * link[0, 0] - axis[0, 3]) / 1e3 / gear[second]
    inertia = 1e-4 * gear[second] + 2.0 * 0.25**2 / gear[second]
    assert found.needed_nm[0, second] == pytest.approx(-at_rest + inertia * changes[0, second])
    rpm = np.abs(plan.trajectory(found.times_s, 1)[:, second]) * gear[second] / 6.0
    np.testing.assert_allclose(found.held_nm[:, second], np.where(rpm <= 60.0, 0.5 - rpm / 600.0, 0.0))


@pytest.mark.slow
def test_plan_report_and_check_say_how_much_is_to_spare() -> None:
    plan = weighty(((0.0, 0.02), (6000.0, 0.01)))
    least = torque.least_margin(plan.arm, plan.trajectory)
    assert least is not None
    assert least.margin < torque.ENOUGH
    said = [line for line in text_summary.lines(plan) if line.startswith("warning: joint 2 has the least")]
    assert len(said) == 1
    assert f"{least.margin:.2f} times as much" in said[0]
    assert text_summary.values(plan)["torque"]["margin"] == least.margin
    figure, caption = run_report._of_arm(plan.arm, plan.trajectory)["torque"]
    assert f"{least.margin:.2f} times" in caption
    assert len(figure.axes[0].lines) == len(plan.arm.driven) + 2
    strong = weighty(((0.0, 20.0), (6000.0, 10.0)))
    assert any(line.startswith("torque: joint") for line in text_summary.lines(strong))
    light = Plan.load(DATA / "trajectory_before_tolerances.json")
    assert text_summary.values(light)["torque"] is None
    assert not any("the least to spare" in line for line in text_summary.lines(light))


@pytest.mark.slow
def test_plans_by_torque_leave_each_motor_what_is_prudent(monkeypatch: pytest.MonkeyPatch) -> None:
    """With a planner whose motions are as much faster as the limits allow, up to a speed limit."""
    plan, fastest = weighty(((0.0, 0.31), (6000.0, 0.3))), 8.0

    def planned(arm: Arm, job: Job, progress: object) -> Plan:
        own, given = (one.driven[0].limits.acceleration_deg_s2 for one in (plan.arm, arm))
        faster = slower(plan.trajectory, min((given / own) ** 0.5, fastest))
        return changed(plan, arm=arm, trajectory=faster)

    monkeypatch.setattr(planner, "plan", planned)
    found = torque.plan_by_torque(plan.arm, plan.job)
    least = torque.least_margin(found.arm, found.trajectory)
    assert least is not None
    assert torque.ENOUGH <= least.margin < 1.02 * torque.ENOUGH
    assert found.notes[-1].endswith("as the motors' torque allows")
    assert [one.limits.speed_deg_s for one in found.arm.driven] == [
        one.limits.speed_deg_s for one in plan.arm.driven
    ]
    strong = weighty(((0.0, 20.0), (6000.0, 20.0)))
    assert torque.plan_by_torque(strong.arm, plan.job).total_s == pytest.approx(plan.total_s / fastest)
    weak = weighty(((0.0, 0.1), (6000.0, 0.1)))
    with pytest.raises(PlanError, match="slower motions do not help: joint 2: at"):
        torque.plan_by_torque(weak.arm, plan.job)
    with pytest.raises(InputError, match="cannot be planned by torque"):
        torque.plan_by_torque(Arm.paper(), plan.job)


def test_check_tells_of_odd_bodies() -> None:
    odd = (Dynamics(1.0, (0.0, 0.0, 0.0), (1.0, 1.0, 3.0, 0.0, 0.0, 0.0)), Dynamics(80.0), Dynamics(0.0))
    arm = Arm.paper()
    driven = dict(zip(arm.driven_indices, odd, strict=True))
    joints = [replace(joint, dynamics=driven.get(number)) for number, joint in enumerate(arm.joints)]
    found = {finding.what for finding in check_arm(replace(arm, joints=tuple(joints)))}
    assert any(what.startswith("no body has the inertia [1.0, 1.0, 3.0") for what in found)
    assert {"a mass of 80 kg", "its inertia_kg_m2 is not given: its mass counts as a point"} <= found


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ("dynamics = { mass_kg = 1.0, centre_mm = [0, 0, 0] }", "no dynamics of joint 2, joint 3"),
        ("dynamics = { mass_kg = 1.0 }", r"joint\[1\].dynamics.centre_mm is missing"),
        ("dynamics = { mass_kg = 0, inertia_kg_m2 = [1] }", r"inertia_kg_m2 = \[1\] is not allowed"),
        *(
            (f"gear_ratio = 2.0, curve_rpm_nm = {curve}", "curve_rpm_nm = .* is not allowed")
            for curve in (
                "[[0, 1]]",
                "[[9, 1], [20, 1]]",
                "[[0, 1], [20, -1]]",
                "[[0, 1], [0, 1]]",
                "[[0], [2, 1]]",
                "3",
            )
        ),
    ],
)
def test_what_is_half_given_or_odd_is_refused(tmp_path: Path, given: str, says: str) -> None:
    path = tmp_path / "arm.toml"
    old = "gear_ratio = 2.0" if "curve" in given else "range_deg"
    new = given if "curve" in given else f"{given}\nrange_deg"
    path.write_text(Path(Arm.paper().source).read_text().replace(old, new, 1))
    with pytest.raises(InputError, match=says):
        Arm.read(path)
