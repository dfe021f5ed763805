"""Backlash in the arm file: what its crossing leaves for motions, and what the board is sent."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from armtempo.basics.errors import InputError
from armtempo.deploy import program_files
from armtempo.diagnosis import drives
from armtempo.encoding import encode, engine_heap
from armtempo.model import arm_json
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.parts import Limits
from armtempo.planning import planner
from armtempo_shared import armrecord, engine_memory
from armtempo_shared.limits import MAX_STEP_RATE, TICK_HZ

PAPER = Arm.paper()
SEED = 20265


def with_backlash(*plays_deg: float, arm: Arm = PAPER) -> Arm:
    """The arm with these backlashes of its joints with a motor."""
    plays = iter(plays_deg)
    joints = [
        replace(joint, motor=replace(joint.motor, backlash_deg=next(plays, 0.0))) if joint.motor else joint
        for joint in arm.joints
    ]
    return replace(arm, joints=tuple(joints))


@pytest.mark.parametrize("play_deg", [0.02, 0.3, 5.0])
def test_motion_and_crossing_together_keep_the_limits(play_deg: float) -> None:
    arm = with_backlash(play_deg)
    (crossing, *others) = arm.crossings
    assert crossing is not None
    assert others == [None, None]
    assert [joint.limits for joint in arm.driven[1:]] == [joint.limits for joint in PAPER.driven[1:]]
    table, kept = PAPER.driven[0].limits, arm.driven[0].limits
    assert kept.speed_deg_s + crossing.speed_deg_s == pytest.approx(table.speed_deg_s)
    assert kept.acceleration_deg_s2 + crossing.acceleration_deg_s2 == pytest.approx(table.acceleration_deg_s2)
    assert kept.speed_deg_s >= 0.75 * table.speed_deg_s
    half_s = crossing.duration_s / 2
    assert crossing.acceleration_deg_s2 * half_s**2 == pytest.approx(play_deg)
    assert crossing.acceleration_deg_s2 * half_s == pytest.approx(crossing.speed_deg_s)


@pytest.mark.parametrize("seed", range(5))
def test_coupled_motors_keep_the_limits(seed: int) -> None:
    rng = np.random.default_rng([SEED, seed])
    matrix = np.eye(3) + rng.uniform(-0.6, 0.6, (3, 3))
    joints = [
        replace(joint, encoder=joint.encoder and replace(joint.encoder, on="motor")) for joint in PAPER.joints
    ]
    plain = replace(PAPER, joints=tuple(joints), coupling=tuple(map(tuple, matrix.tolist())))
    arm = with_backlash(0.3, 0.0, 1.0, arm=plain)
    most = np.abs(matrix) @ np.array([joint.limits.values for joint in plain.driven])
    kept = np.abs(matrix) @ np.array([joint.limits.values for joint in arm.driven])
    for crossing, before, after in zip(arm.crossings, most, kept, strict=True):
        if crossing:
            assert after[0] + crossing.speed_deg_s <= before[0] * (1 + 1e-12)
            assert after[1] + crossing.acceleration_deg_s2 <= before[1] * (1 + 1e-12)


def test_what_the_board_is_sent() -> None:
    arm = with_backlash(0.3, 0.0001)
    data = encode.arm_record(arm)
    head, rows, _ = armrecord.unpack(data)
    row, *others = armrecord.unpack_backlash(data)
    crossing, motor = arm.crossings[0], arm.motors[0]
    assert crossing is not None
    assert [other["steps"] for other in others] == [0, 0]
    assert row["steps"] == round(0.3 * 6400 / 180)
    assert not row["on_motor"]
    half_ticks = 64 * row["pace"] * (0.3 * motor.steps_per_deg / 2) ** 0.5
    assert half_ticks / TICK_HZ == pytest.approx(crossing.duration_s / 2, rel=1e-3)
    assert rows[0]["max_rate"] == armrecord.unpack(encode.arm_record(PAPER))[1][0]["max_rate"]
    assert head["identity"] == armrecord.unpack(encode.arm_record(PAPER))[0]["identity"]


def test_an_arm_without_a_step_of_it_is_sent_as_before() -> None:
    assert encode.arm_record(with_backlash(0.0, 0.0001))[4] == armrecord.VERSION
    assert encode.arm_record(with_backlash(0.0)) == encode.arm_record(PAPER)


@pytest.mark.parametrize(
    ("play_deg", "acceleration", "said"),
    [(10.0, 0.05, "to cross it takes"), (3.0, 3000.0, "until they are made the motor reaches")],
)
def test_what_cannot_be_crossed_is_refused(play_deg: float, acceleration: float, said: str) -> None:
    """When it is planned, before anything is sent, and when it is sent."""
    arm = with_backlash(0.0, play_deg)
    limits = replace(
        PAPER.table_joints[1].limits,
        acceleration_deg_s2=acceleration,
        speed_deg_s=400.0,  # type: ignore[type-var]
    )
    joints = [replace(joint, limits=limits) if joint.name == "joint 2" else joint for joint in arm.joints]
    arm = replace(arm, joints=tuple(joints))
    for refuses in (encode.arm_record, lambda arm: planner.plan(arm, Job.paper(arm))):
        with pytest.raises(InputError, match=f"joint 2: backlash_deg = .*{said}"):
            refuses(arm)


def test_the_crossing_counts_for_the_step_rate() -> None:
    """A speed that leaves too little for it is refused when it is planned, too."""
    (joint, *others) = with_backlash(10.0).joints
    assert joint.motor is not None
    most_deg_s = MAX_STEP_RATE / joint.motor.steps_per_deg
    limits = Limits(1.001 * most_deg_s, 50.0, 150.0)
    arm = replace(PAPER, joints=(replace(joint, limits=limits), *others))
    assert arm.driven[0].limits.speed_deg_s < most_deg_s
    for refuses in (encode.arm_record, lambda arm: planner.plan(arm, Job.paper(arm))):
        with pytest.raises(InputError, match=r"joint 1 at its speed limit of .* steps/s"):
            refuses(arm)


def test_check_names_it_and_the_memory_grows() -> None:
    arm = with_backlash(0.3)
    (line,) = [found for found in drives.findings(arm) if "backlash" in found.what]
    assert line.where == "joint 1"
    more = engine_memory.object_bytes(3, 1) - engine_memory.object_bytes(3)
    needed = engine_memory.needed_bytes(encode.step_rates(arm))
    assert f" {needed + more} bytes for 3 joints: fits only with the program in" in engine_heap.of_arm(arm)


@pytest.mark.slow
def test_the_core_on_stock_micropython_does_not_cross_it() -> None:
    """Its modules are not there, and the host says so before it sends the arm."""
    arm = with_backlash(0.3)
    assert "armtempo_board.motion.backlash_drive" not in program_files.core()
    with pytest.raises(InputError, match=r"has backlash_deg, which the program.s core .* does not cross"):
        engine_heap.check(arm, engine_heap.CORE)
    engine_heap.check(arm, engine_heap.IN_FIRMWARE)
    assert "needs the program in the firmware" in engine_heap.of_arm(arm, engine_heap.CORE)


def test_a_run_keeps_it(tmp_path: Path) -> None:
    arm = with_backlash(0.3)
    arm_json.save(arm, tmp_path / "arm.json")
    assert arm_json.load(tmp_path / "arm.json").joints[0].motor == arm.joints[0].motor
