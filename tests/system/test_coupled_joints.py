"""Coupled joints on the virtual board: by the pulses on its pins the joints go where they should, also when homing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from armtempo.basics.errors import InputError
from armtempo.link import Client, open_board
from armtempo.model import engine_pins, home_switches
from armtempo.model.arm import Arm
from armtempo.model.parts import LimitSwitches
from armtempo.planning.jog.jog_motion import move_of
from armtempo.robot import arm_state, goto, homing, jog
from armtempo.robot.stop_request import StopRequest
from armtempo.simulator import LaunchOptions, edgelog, launch

from tests.system import commandline

DIFFERENTIAL = ((1.0, 0.0, 0.0), (0.0, -1.0, 2.0), (0.0, 1.0, 2.0))
CARRIED = ((1.0, 0.0, 0.0), (0.4, 1.0, 0.0), (0.0, -1.0, 1.0))
"""Joint 1 carries the belt of joint 2 along, joint 2 that of joint 3."""
TARGET_DEG = np.array([14.0, -70.0, 20.0])


def coupled(
    coupling: tuple[tuple[float, ...], ...],
    switches: dict[int, LimitSwitches] | None = None,
    **changed: object,
) -> Arm:
    """The paper's arm with this coupling, encoders on the motors, and these switches."""
    joints = []
    for number, joint in enumerate(commandline.ARM.joints):
        encoder = joint.encoder and replace(joint.encoder, on="motor", counts_per_rev=400)
        model = replace(joint.model, holding_torque_nm=0.0)  # ideal motors
        fitted = (switches or {}).get(number, joint.switches)
        joints.append(replace(joint, encoder=encoder, model=model, switches=fitted))
    return replace(commandline.ARM, joints=tuple(joints), coupling=coupling, **changed)  # type: ignore[arg-type]


def on_board(
    arm: Arm,
    act: Callable[[Client, StopRequest], None],
    folder: Path,
    start_deg: tuple[float, ...] | None = None,
) -> np.ndarray:
    """How far each motor has turned behind its gear on a virtual board that did ``act``, by the pins' edges."""
    log = folder / "edges"
    options = LaunchOptions(arm=arm, start_deg=start_deg, edge_log=log)
    with launch(options) as virtual, open_board(virtual.port) as board, StopRequest() as stop:
        arm_state.configure(board, arm, replace=True)
        act(board, stop)
    (cycle,) = edgelog.read(log)
    return np.array([moved_deg(cycle, index, arm) for index in range(len(arm.driven))])


def moved_deg(cycle: edgelog.PowerCycle, index: int, arm: Arm) -> float:
    pins, motor = engine_pins.table(), arm.driven[index].motor
    step, direction = pins["STEP"][motor.channel - 1][0], pins["DIR"][motor.channel - 1]
    ticks, levels = cycle.pins.get(step, (np.array([], int), np.array([], int)))
    turns, to = cycle.pins.get(direction, (np.array([], int), np.array([], int)))
    at = np.searchsorted(turns, ticks[levels == 1], side="right")
    level = np.concatenate(([1 - to[0] if len(to) else 0], to))[at]
    steps = np.where(level == 1, 1, -1).sum() * motor.direction
    return float(steps) * 360.0 / (motor.steps_per_rev * motor.microsteps * motor.gear_ratio)


@pytest.mark.parametrize("coupling", [DIFFERENTIAL, CARRIED])
def test_motors_turn_by_the_matrix_times_the_joints(
    coupling: tuple[tuple[float, ...], ...], tmp_path: Path
) -> None:
    arm = coupled(coupling)
    seen: list[np.ndarray] = []

    def act(board: Client, stop: StopRequest) -> None:
        arm_state.home(board, arm)
        goto.go_to(board, arm, TARGET_DEG, stop)
        assert arm_state.is_at(board, arm, TARGET_DEG)
        goto.go_to(board, arm, TARGET_DEG, stop)  # is there: no motion
        move = move_of(arm, "joint 2", None, 5.0, None)
        jog.step(board, arm, move, 0.5, stop)
        seen.append(arm_state.posture_deg(board, arm))
        counts = board.status().positions.counts
        seen.append(arm.transmission.angles_of_counts(counts))

    turned = on_board(arm, act, tmp_path)
    wanted = TARGET_DEG + np.array([0.0, 5.0, 0.0])
    step_deg = np.array([1 / joint.motor.steps_per_deg for joint in arm.driven])
    assert np.all(np.abs(turned - np.array(coupling) @ (wanted - arm.home_deg)) <= 2 * step_deg)
    solved = np.array(arm.home_deg) + np.linalg.solve(np.array(coupling), turned)
    np.testing.assert_allclose(seen[0], solved, atol=0.02)
    np.testing.assert_allclose(seen[1], solved, atol=0.3)  # counts are coarser than steps


def test_thor_bends_and_turns_its_wrist(tmp_path: Path) -> None:
    """By the formulas of its makers: a6 = (m5 + m6) / 4, a5 = m6 - 2 a6."""
    arm = Arm.load("thor")

    def act(board: Client, stop: StopRequest) -> None:
        arm_state.home(board, arm)
        goto.go_to(board, arm, np.array([0.0, 0.0, 0.0, 0.0, 35.0, -50.0]), stop)

    turned = on_board(arm, act, tmp_path)
    assert np.all(turned[:4] == 0.0)
    sixth = (turned[4] + turned[5]) / 4
    assert (turned[5] - 2 * sixth, sixth) == pytest.approx((35.0, -50.0), abs=0.12)


def switch(pin: str, **at: float) -> LimitSwitches:
    return LimitSwitches(**({"low": pin} if "low_deg" in at else {"high": pin}), **at)  # type: ignore[arg-type]


SWITCHED = {1: switch("PD0", low_deg=-171.0), 2: switch("PD1", high_deg=101.0)}
"""Just beyond the ranges, which are -170 to 10 and -160 to 100."""


def test_homing_of_a_pair(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Joint 2 rests on its switch, which is not to end motions of joint 3, although the motor of joint 2 turns."""
    start_deg, order = (0.0, -172.0, 90.0), ("joint 3", "joint 2")
    monkeypatch.setattr(home_switches, "FAST", 1.0)  # as the simulation takes its time
    monkeypatch.setattr(home_switches, "SLOW", 0.2)
    arm = coupled(DIFFERENTIAL, SWITCHED, homing=tuple((name,) for name in order))
    near = {"joint 2": -150.0, "joint 3": 80.0}  # the way home takes the simulation long
    homes = [replace(joint, home_deg=near.get(joint.name, joint.home_deg)) for joint in arm.joints]
    arm = replace(arm, joints=tuple(homes))

    def act(board: Client, stop: StopRequest) -> None:
        homing.home_to_switches(board, arm, stop)
        assert board.status().known == 0b110
        assert arm_state.known_joints(board.status(), arm) == [False, True, True]

    turned = on_board(arm, act, tmp_path, start_deg)
    stands = np.array(start_deg) + np.linalg.solve(np.array(DIFFERENTIAL), turned)
    np.testing.assert_allclose(stands[1:], np.array(arm.home_deg)[1:], atol=0.1)


def test_homing_of_one_of_a_pair_is_refused(tmp_path: Path) -> None:
    arm = coupled(DIFFERENTIAL, {1: SWITCHED[1]})

    def act(board: Client, stop: StopRequest) -> None:
        with pytest.raises(
            InputError, match="joint 3: no limit switch whose angle is known, but coupled with joint 2"
        ):
            homing.home_to_switches(board, arm, stop)

    assert np.all(on_board(arm, act, tmp_path) == 0.0)
