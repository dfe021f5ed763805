"""Coupled joints: the file's table, what becomes of it in steps, counts, limits, torques and records; against numpy."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
import pytest
from armtempo.basics.errors import InputError
from armtempo.diagnosis.arm_check import check_arm
from armtempo.diagnosis.finding import Level
from armtempo.encoding import encode
from armtempo.model import arm_json, drive_limits, shipped
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.parts import Driver, Dynamics, Encoder, LimitSwitches
from armtempo.model.plan import Plan
from armtempo.model.transmission import Transmission
from armtempo.planning import board_limits, checks, planner, point_to_point, torque
from armtempo.planning.jog import jog_motion
from armtempo.report import evaluation, run_folder, run_reader, run_report, verdict
from armtempo.report.run import Run
from armtempo.robot import arm_state, goto
from armtempo.robot.stop_request import StopRequest
from armtempo_shared import armrecord, limits, motion

from tests.host import made_runs

SEED = 20_261_127
THOR = Arm.load("thor")
PAPER = Arm.paper()
WRIST = np.array([[-1.0, 2.0], [1.0, 2.0]])


def random_coupling(rng: np.random.Generator, joints: int) -> np.ndarray:
    """A well-conditioned matrix with some zeros and no zero on its diagonal."""
    while True:
        matrix = rng.uniform(-2.0, 2.0, (joints, joints)) * (rng.random((joints, joints)) < 0.6)
        np.fill_diagonal(matrix, rng.choice([-1.0, 1.0], joints) * rng.uniform(0.5, 2.0, joints))
        if np.linalg.cond(matrix) < 20.0:
            return matrix


class Known(NamedTuple):
    """A status in which the positions of all motors are known."""

    positions: SimpleNamespace

    def joint_known(self, motor: int) -> bool:
        return True


def rows(matrix: np.ndarray) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(row) for row in matrix.tolist())


def with_coupling(arm: Arm, matrix: np.ndarray) -> Arm:
    """The arm with a coupling, without encoders, switches, and what these forbid."""
    joints = [replace(joint, encoder=None, switches=LimitSwitches()) for joint in arm.joints]
    return replace(arm, joints=tuple(joints), coupling=rows(matrix), homing=())


@pytest.mark.parametrize("seed", range(20))
def test_steps_counts_and_back(seed: int) -> None:
    rng = np.random.default_rng([SEED, seed])
    joints = int(rng.integers(2, 7))
    matrix = random_coupling(rng, joints)
    per_deg, counts = rng.uniform(5.0, 300.0, (2, joints))
    gears = Transmission(tuple(per_deg), tuple(counts), rows(matrix))
    angles = rng.uniform(-180.0, 180.0, (50, joints))
    steps = np.array([per_deg * (matrix @ each) for each in angles])
    np.testing.assert_allclose(gears.steps(angles), steps, rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(gears.angles_of_steps(steps), angles, atol=1e-9)
    np.testing.assert_allclose(gears.angles_of_counts(steps / per_deg * counts), angles, atol=1e-9)
    moved = np.abs(gears.angles_of_steps(steps + rng.uniform(-1.0, 1.0, steps.shape)) - angles)
    assert np.all(moved <= gears.step_deg + 1e-9)
    torques, speeds = rng.uniform(-9.0, 9.0, (2, 50, joints))
    work = np.sum(gears.motor_loads(torques) * gears.motors_deg(speeds), axis=1)
    np.testing.assert_allclose(work, np.sum(torques * speeds, axis=1), atol=1e-9)


def test_without_a_coupling_every_bit_stays() -> None:
    rng = np.random.default_rng(SEED)
    gears = PAPER.transmission
    angles = rng.uniform(-180.0, 180.0, (50, 3))
    per_deg = np.array([joint.steps_per_deg for joint in PAPER.driven])
    assert np.array_equal(gears.steps(angles), angles * per_deg)
    steps = rng.integers(-9000, 9000, (50, 3))
    assert np.array_equal(gears.angles_of_steps(steps), steps / per_deg)
    assert not gears.groups
    assert PAPER.motors is PAPER.driven
    trajectory = point_to_point.straight("x", PAPER.home_deg, (10.0, -70.0, 50.0), PAPER)
    alone = replace(
        PAPER,
        joints=tuple(replace(j, encoder=j.encoder and replace(j.encoder, on="motor")) for j in PAPER.joints),
    )
    same = replace(alone, coupling=rows(np.eye(3)))
    records = [motion.Motion(encode.motion_record(trajectory, arm)) for arm in (alone, same)]
    for index in range(3):
        points = [
            record.points(record.angle_offset(index), record.segments + record.degree) for record in records
        ]
        assert points[0] == points[1]


def test_unmeasured_motors_leave_joints_unmeasured() -> None:
    """The second joint of a chain of belts needs both encoders, the first only its own."""
    gears = Transmission(
        (10.0, 10.0, 10.0), (4.0, 0.0, 8.0), ((1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    )
    assert gears.measured == (True, False, True)
    assert gears.known((True, True, False)) == [True, True, False]
    assert gears.known((False, True, True)) == [False, False, True]
    assert gears.groups == ((0, 1),)
    assert [gears.is_alone(joint) for joint in range(3)] == [True, False, True]
    assert gears.count_deg[0] == 0.25
    assert np.isnan(gears.count_deg[1])


def test_a_goto_asks_for_the_position_once(monkeypatch: pytest.MonkeyPatch) -> None:
    asked, moved = [], []

    def status() -> Known:
        asked.append(1)
        return Known(SimpleNamespace(commanded_steps=tuple(PAPER.transmission.whole_steps(PAPER.home_deg))))

    monkeypatch.setattr(goto, "move_once", lambda *given: moved.append(given))
    there = np.array(PAPER.home_deg) + 5.0
    goto.go_to(SimpleNamespace(status=status), PAPER, there, StopRequest())  # type: ignore[arg-type]
    assert (len(asked), len(moved)) == (1, 1)


@pytest.mark.parametrize("seed", range(10))
def test_a_posture_at_the_ends_of_ranges_is_found_again_from_its_steps(seed: int) -> None:
    """Whole steps of the motors are up to half a step off, which the board allows; no joint leaves its range."""
    rng = np.random.default_rng([SEED, seed])
    matrix = random_coupling(rng, 3)
    arm = with_coupling(PAPER, matrix)
    low, high = np.array([joint.range_deg for joint in arm.driven]).T
    for _ in range(10):
        posture = np.where(
            rng.random(3) < 0.7, np.where(rng.random(3) < 0.5, low, high), rng.uniform(low, high)
        )
        steps = arm.transmission.whole_steps(posture)
        status = SimpleNamespace(positions=SimpleNamespace(commanded_steps=tuple(steps)))
        found = arm_state.angles_deg(status, arm)  # type: ignore[arg-type]
        assert np.all((low <= found) & (found <= high))
        assert np.max(np.abs(arm.transmission.steps(found) - steps)) <= 0.5 + 1e-6
        point_to_point.posture(found, arm)
        client = SimpleNamespace(status=lambda positions=status.positions: Known(positions))
        assert arm_state.is_at(client, arm, posture)  # type: ignore[arg-type]
        assert not arm_state.is_at(client, arm, posture + 2.0 * arm.transmission.step_deg)  # type: ignore[arg-type]
    far = SimpleNamespace(positions=SimpleNamespace(commanded_steps=tuple(10 * step for step in steps)))
    np.testing.assert_allclose(  # far beyond the ranges: no posture is made up
        matrix @ arm_state.angles_deg(far, arm) * arm.transmission.steps_per_deg,  # type: ignore[arg-type]
        10 * np.array(steps),
        atol=1e-6,
    )


@pytest.mark.parametrize("seed", range(5))
def test_motors_keep_what_their_drivers_allow_when_all_joints_are_fastest(seed: int) -> None:
    rng = np.random.default_rng([SEED, seed])
    matrix = random_coupling(rng, 3)
    slow = Driver(pulse_us=30.0, low_us=200.0, dir_setup_us=400.0, dir_hold_us=400.0)
    arm = replace(with_coupling(PAPER, matrix), driver=slow)
    kept = np.array([joint.limits.values for joint in arm.driven])
    table = np.array([joint.limits.values for joint in arm.table_joints if joint.limits])
    assert np.all(kept <= table * (1 + 1e-12))
    for row, joint in zip(np.abs(matrix), arm.table_joints, strict=True):
        assert joint.motor is not None
        bounds = {bound.key: bound.value for bound in drive_limits.bounds(joint.motor, None, slow)}
        fastest = row @ kept
        assert fastest[0] <= bounds["speed_deg_s"] * (1 + 1e-9)
        assert fastest[1] <= bounds["acceleration_deg_s2"] * (1 + 1e-9)
    assert any(note.startswith("joint 1: ") for note in checks.hardware_notes(arm))
    _, records, _ = armrecord.unpack(encode.arm_record(arm))
    for row, record, joint in zip(matrix, records, arm.driven, strict=True):
        ends = np.sort(np.array([joint.range_deg for joint in arm.driven]) * row[:, None], axis=1).sum(axis=0)
        assert np.allclose(
            [record["min_steps"], record["max_steps"]], ends * joint.motor.steps_per_deg, atol=0.51
        )
        assert record["max_rate"] >= np.abs(row) @ kept[:, 0] * joint.motor.steps_per_deg


@pytest.mark.parametrize("path", ["through", pytest.param("free", marks=pytest.mark.slow)])
def test_a_planned_motion_as_the_board_reads_it(path: str) -> None:
    """The steps of its record are the matrix times the joints' angles, at any u, to the integers' rounding."""
    via = ((0.0,) * 6, (20.0, 10.0, -10.0, 15.0, 40.0, -60.0), (5.0, 0.0, 10.0, -15.0, -30.0, 90.0))
    plan = planner.plan(
        THOR, Job(name="wrist", via=via, path=path, refine=1 if path == "through" else "auto")
    )
    data = encode.motion_record(plan.trajectory, THOR)
    record = motion.Motion(data)
    points = (
        np.array(
            [record.points(record.angle_offset(index), record.segments + record.degree) for index in range(6)]
        )
        / 2.0**limits.STEP_FRACTION_BITS
    )
    wanted = np.array([joint.angle_points_deg for joint in plan.trajectory.joints])
    wanted[4:] = WRIST @ wanted[4:]
    wanted *= np.array([[joint.motor.steps_per_deg] for joint in THOR.driven])
    np.testing.assert_allclose(points, wanted, atol=1e-6)
    times = np.linspace(0.0, plan.trajectory.duration_s, 101)
    back = encode.decoded(data, THOR.transmission, "wrist")
    np.testing.assert_allclose(back(times), plan.trajectory(times), atol=1e-6)
    most = np.abs(plan.trajectory(times, 1)).max(axis=0)
    assert np.all(most <= [20.0 * (1 + 1e-9)] * 6)
    assert most.max() > 19.0


def test_a_time_axis_for_each_joint_is_refused() -> None:
    job = Job(name="wrist", via=((0.0,) * 6, (9.0,) * 6), path="through", timing="per-joint")
    with pytest.raises(InputError, match="coupled joints, whose motors need one time axis"):
        planner.plan(THOR, job)
    paper = planner.plan(PAPER, replace(Job.paper(PAPER), iterations=2, population=4, timing="per-joint"))
    with pytest.raises(InputError, match="coupled joints, whose motors need one time axis"):
        encode.motion_record(
            paper.trajectory, with_coupling(PAPER, random_coupling(np.random.default_rng(SEED), 3))
        )


def test_a_joints_jog_turns_both_of_its_motors() -> None:
    move = jog_motion.move_of(THOR, "joint 5", None, 10.0, None)
    start = [0.0, 0.0, 0.0, 0.0, 5.0, 30.0]
    found = jog_motion.plan("jog", THOR, start, move, 0.3)
    points = board_limits.motor_points_steps(found.trajectory, THOR)
    splines = [replace(j, angle_points_deg=p) for j, p in zip(found.trajectory.joints, points, strict=True)]
    begins = THOR.transmission.steps(start)
    ahead = [spline(0.0) for spline in splines] - begins
    assert np.abs(ahead).max() < 0.5  # of a step: the board takes it for the start
    turned = [spline(spline.duration_s) for spline in splines] - begins
    np.testing.assert_allclose(turned, [0, 0, 0, 0, -10 * 80 / 9, 10 * 80 / 9], atol=1e-9)


def test_torque_at_the_motors_of_a_wrist() -> None:
    """As much work as at the joints: t5 w5 + t6 w6 = m5 v5 + m6 v6; and the rotors' own inertia."""
    bodies = [Dynamics(0.3, (0.0, 10.0, 20.0), friction_nm=0.01)] * 6
    arm = replace(
        THOR, joints=tuple(replace(j, dynamics=b) for j, b in zip(THOR.joints, bodies, strict=True))
    )
    trajectory = point_to_point.straight("x", [0.0] * 6, [0.0, 0.0, 0.0, 0.0, 40.0, -70.0], arm)
    alone = torque.of_motion(replace(arm, coupling=()), trajectory)
    found = torque.of_motion(arm, trajectory)
    assert alone is not None
    assert found is not None
    by_hand = np.linalg.solve(WRIST.T, alone.needed_nm[:, 4:].T).T  # gear ratio 1, no rotor inertia
    np.testing.assert_allclose(found.needed_nm[:, 4:], by_hand, atol=1e-12)
    assert np.array_equal(found.needed_nm[:, :4], alone.needed_nm[:, :4])


@pytest.mark.parametrize(
    ("table", "words"),
    [
        (
            '"joint 5" = { "joint 5" = 1.0, "joint 6" = 1.0 }\n"joint 6" = { "joint 5" = 1.0, "joint 6" = 1.0 }',
            "singular",
        ),
        (
            '"joint 5" = { "joint 6" = 1.0 }\n"joint 6" = { "joint 5" = 1.0 }',
            "the motor of joint 5 does not turn joint 5",
        ),
        ('"joint 7" = { "joint 5" = 1.0 }', "no joint has this name"),
        (
            '"joint 5" = { "jont 6" = 1.0, "joint 5" = 1.0 }',
            "'jont 6': no joint has this name; did you mean 'joint 6'",
        ),
        ('"joint 5" = { "joint 5" = "one" }', "is not allowed"),
        ('"joint 5" = 3', "is not allowed"),
        ('"joint 5" = {}', "is not allowed"),
        ('"joint 5" = { "joint 5" = nan }', "is not allowed"),
    ],
)
def test_a_coupling_that_is_none_is_refused(table: str, words: str, tmp_path: Path) -> None:
    text = shipped.files()["thor"].read_text(encoding="utf-8").split("[coupling]")[0]
    (tmp_path / "arm.toml").write_text(f"{text}[coupling]\n{table}\n", encoding="utf-8")
    with pytest.raises(InputError, match=words):
        Arm.load(tmp_path / "arm.toml")


def test_a_joint_without_a_motor_cannot_be_coupled(tmp_path: Path) -> None:
    text = shipped.arm_path().read_text(encoding="utf-8")
    (tmp_path / "arm.toml").write_text(
        f'{text}\n[coupling]\n"joint 3" = {{ "joint 3" = 1, "joint 4" = 1 }}\n'
    )
    with pytest.raises(InputError, match="'joint 4': this joint has no motor"):
        Arm.load(tmp_path / "arm.toml")


def test_what_the_board_cannot_do_with_coupled_joints_is_refused() -> None:
    fifth = THOR.joints[4]
    rest = (THOR.joints[5],)

    def arm(**changed: object) -> Arm:
        return replace(THOR, joints=(*THOR.joints[:4], replace(fifth, **changed), *rest))  # type: ignore[arg-type]

    with pytest.raises(
        InputError, match="joint 5 is coupled with joint 6, so its encoder cannot be on the joint"
    ):
        arm(encoder=Encoder(1, 4000))
    arm(encoder=Encoder(1, 4000, on="motor"))
    with pytest.raises(InputError, match="its switches can be used for homing only"):
        arm(switches=LimitSwitches(low=1, low_deg=-91.0))
    arm(switches=LimitSwitches(low="PD0", low_deg=-91.0))
    with pytest.raises(InputError, match="joint 5, joint 6 are coupled, so they cannot be homed together"):
        replace(THOR, homing=(("joint 5", "joint 6"),))
    carrier = replace(PAPER, coupling=((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)))
    assert carrier.driven[0].encoder  # joints that have their motor alone keep theirs


def test_its_file_names_each_finding() -> None:
    assert not [found for found in check_arm(THOR) if found.level in (Level.ERROR, Level.WARNING)]
    limits = [replace(joint.limits, speed_deg_s=15_000.0) for joint in THOR.driven[4:]]
    wrist = [replace(joint, limits=most) for joint, most in zip(THOR.joints[4:], limits, strict=True)]
    fast = (*THOR.joints[:4], *wrist)
    said = [str(found) for found in check_arm(replace(THOR, joints=fast))]
    assert any(
        "joint 5 (its motor, which also moves joint 6)" in words and "400000 steps/s" in words
        for words in said
    )
    blind = (*THOR.joints[:4], replace(THOR.joints[4], encoder=Encoder(1, 4000, on="motor")), THOR.joints[5])
    said = [str(found) for found in check_arm(replace(THOR, joints=blind))]
    assert any("joint 5" in words and "alone does not give its angle" in words for words in said)
    with pytest.raises(InputError, match=r"joint 5 \(its motor, which also moves joint 6\)"):
        encode.arm_record(replace(THOR, joints=fast))


@pytest.mark.slow
def test_files_keep_the_coupling(tmp_path: Path) -> None:
    arm_json.save(THOR, tmp_path / "arm.json")
    assert arm_json.load(tmp_path / "arm.json") == THOR
    plan = planner.plan(THOR, Job(name="x", via=((0.0,) * 6, (5.0,) * 6), path="through", refine=1))
    plan.save(tmp_path / "plan.json")
    assert Plan.load(tmp_path / "plan.json").arm.coupling == THOR.coupling
    scales = run_folder.scales(THOR)
    assert run_reader.scales({"joints": [scale.values for scale in scales]}) == scales
    assert "coupling" not in run_folder.scales(PAPER)[0].values
    damaged = [replace(scale, coupling=scales[4].coupling).values for scale in scales]
    with pytest.raises(ValueError, match="does not turn"):
        run_reader.scales({"joints": damaged})


def test_another_coupling_is_another_arm_for_the_board() -> None:
    other = replace(
        THOR, coupling=rows(np.block([[np.eye(4), np.zeros((4, 2))], [np.zeros((2, 4)), -WRIST]]))
    )
    heads = [
        armrecord.unpack(encode.arm_record(arm))[0]["identity"]
        for arm in (THOR, other, replace(THOR, coupling=()))
    ]
    assert len(set(heads)) == 3


def test_rows_of_the_file_are_those_of_motors() -> None:
    table = tomllib.loads(shipped.files()["thor"].read_text(encoding="utf-8"))["coupling"]
    assert table == {
        "joint 5": {"joint 5": -1.0, "joint 6": 2.0},
        "joint 6": {"joint 5": 1.0, "joint 6": 2.0},
    }
    np.testing.assert_array_equal(np.array(THOR.coupling)[4:, 4:], WRIST)


@pytest.mark.slow
@pytest.mark.parametrize("on_board", [False, True])
def test_a_report_sees_the_joints(on_board: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Steps and counts of motors become angles of joints, also of a motion that only the board had."""
    made_runs.draw_nothing(monkeypatch)
    encoders = [replace(j, encoder=j.encoder and replace(j.encoder, on="motor")) for j in PAPER.joints]
    arm = replace(
        PAPER, joints=tuple(encoders), coupling=((1.0, 0.0, 0.0), (0.0, -1.0, 2.0), (0.0, 1.0, 2.0))
    )
    via = ((0.0, -60.0, 40.0), (20.0, -90.0, 60.0), (40.0, -60.0, 0.0))
    plan = planner.plan(arm, Job(name="wrist", via=via, path="through", refine=1))
    folder = made_runs.make(tmp_path / "run", repetitions=1, scatter_deg=0.0, plan=plan, on_board=on_board)
    run = Run.load(folder)
    for joint, end in zip(run.results, via[-1], strict=True):
        assert joint.angle_deg == pytest.approx(end, abs=0.1)
        assert abs(joint.error_deg) < 0.1
    per_deg = [joint.motor.steps_per_deg for joint in arm.driven]
    assert [joint.steps_sent for joint in run.results] == pytest.approx(
        np.multiply([40.0, -80.0, -80.0], per_deg), abs=1
    )
    found = evaluation.evaluate(folder)
    curves = found.legs[0].curves
    assert np.max(np.abs(curves.each[:, 0] - curves.theory[0])) < 0.1
    judged = verdict.of(found)
    assert "the board made every step pulse of the motion" in str(judged)
    assert run_report.write(folder).is_file()
