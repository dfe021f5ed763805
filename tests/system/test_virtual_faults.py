"""What the virtual board can be made to suffer, and that the board program notices it."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from armtempo.link import open_board
from armtempo.link.board_messages import Status
from armtempo.link.follow import RunEnd
from armtempo.model.arm import Arm
from armtempo.model.parts import JointModel
from armtempo.planning import point_to_point
from armtempo.records import encode
from armtempo.robot import arm_state, stored_motion
from armtempo.robot.stop_request import StopRequest
from armtempo.simulator import InjectedFault, LaunchOptions, edgelog, launch
from armtempo_shared.wire import ERROR_CODES

from tests.system import boards

TARGET_DEG = np.array([30.0, -85.0, 60.0])
GUARDED = replace(boards.ARM, safety=replace(boards.ARM.safety, estop_fitted=True))


def run(
    *faults: InjectedFault, arm: Arm = boards.ARM, model: Arm | None = None, log: Path | None = None
) -> tuple[RunEnd, Status]:
    """A short motion from home, and how the board stands after it."""
    home_deg = np.array(arm.home_deg)
    data = encode.motion_record(point_to_point.straight("move", home_deg, TARGET_DEG, arm), arm)
    with (
        launch(LaunchOptions(faults=faults, arm=model, edge_log=log)) as process,
        open_board(process.port) as board,
    ):
        arm_state.configure(board, arm, replace=True)
        arm_state.home(board, arm)
        stored = stored_motion.store(board, "move", data)
        with StopRequest() as stop:
            end = stored_motion.replay(board, stored, stop)
        return end, board.status()


def code(end: RunEnd) -> str:
    """Name of the fault that ended a run."""
    return stored_motion.fault_name(end.fault)


def test_nothing() -> None:
    end, status = run()
    steps = np.array([joint.steps_per_deg for joint in boards.ARM.driven])
    assert not end.fault
    assert np.all(np.abs(np.array(status.positions.commanded_steps) - TARGET_DEG * steps) <= 0.5)


def test_short_stall_does_no_harm() -> None:
    end, _ = run(InjectedFault("stall", at_s=0.4, ms=10))
    assert not end.fault


@pytest.mark.parametrize("at_s", [0.3, 0.55, 0.8])
def test_long_stall_is_an_underrun(at_s: float) -> None:
    end, status = run(InjectedFault("stall", at_s=at_s, ms=1500))
    assert code(end) == "underrun"
    assert status.known == 7


@pytest.mark.parametrize("at_s", [0.0, 0.41, 0.77])
def test_estop_freezes_within_20_us(at_s: float, tmp_path: Path) -> None:
    log = tmp_path / "edges"
    end, _ = run(InjectedFault("input", at_s=at_s, name="E15", level=0), arm=GUARDED, log=log)
    assert code(end) == "estop"
    pins = edgelog.read(log)[-1].motion()
    (tripped,) = pins["E15"][0]
    for pin in ("A15", "A1", "B10"):
        ticks, levels = pins.get(pin, (np.array([], int), np.array([], int)))
        late = ticks[ticks > tripped + 20 * 84]
        assert len(late) <= 1  # the end of a pulse that had begun
        assert not levels[ticks > tripped + 20 * 84].any()


def test_blocked_joint_is_a_following_error() -> None:
    end, _ = run(InjectedFault("block", at_s=0.3, joint=1))
    assert (code(end), end.fault_joint) == ("following", 1)


def test_slipped_coupling_is_a_following_error() -> None:
    end, _ = run(InjectedFault("slip", at_s=0.5, joint=2, counts=-60))
    assert (code(end), end.fault_joint) == ("following", 2)


def test_hang_makes_the_watchdog_bite() -> None:
    with (
        launch(LaunchOptions(faults=[InjectedFault("hang", at_s=0.3)])) as process,
        open_board(process.port) as board,
    ):
        arm_state.configure(board, boards.ARM, replace=True)
        arm_state.home(board, boards.ARM)
        home_deg = np.array(boards.ARM.home_deg)
        data = encode.motion_record(
            point_to_point.straight("move", home_deg, TARGET_DEG, boards.ARM), boards.ARM
        )
        stored = stored_motion.store(board, "move", data)
        board.start(stored.name, stored.crc)
        before = board.info
        assert before is not None
        for _ in range(100):
            board.hello()
            assert board.info is not None
            if board.info.boot != before.boot:
                break
            time.sleep(0.05)
        assert board.info.boot != before.boot
        assert board.status().fault == ERROR_CODES["watchdog"]
        assert board.status().known == 0


def test_crash_is_an_internal_fault() -> None:
    end, _ = run(InjectedFault("crash", at_s=0.5))
    assert code(end) == "internal"
    assert "injected crash" in end.notices[0]


def test_motor_driven_beyond_its_torque_loses_steps() -> None:
    heavy = replace(boards.ARM.joints[0].model, inertia_kg_m2=6.0)
    joints = (replace(boards.ARM.joints[0], model=heavy), *boards.ARM.joints[1:])
    end, _ = run(model=replace(boards.ARM, joints=joints))
    assert (code(end), end.fault_joint) == ("following", 0)


def test_without_a_model_the_motors_are_ideal() -> None:
    joints = tuple(replace(joint, model=JointModel()) for joint in boards.ARM.joints)
    ends = [run(model=model)[0] for model in (None, replace(boards.ARM, joints=joints))]
    assert ends[0].positions == ends[1].positions
