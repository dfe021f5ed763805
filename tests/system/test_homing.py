"""A homing run to limit switches on the virtual board, whose switches trip if the arm file says so."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from armtempo.basics.errors import BoardError, InputError, LinkError
from armtempo.link import Client, open_board
from armtempo.model import engine_pins, shipped
from armtempo.model.arm import Arm
from armtempo.model.parts import DrivenJoint
from armtempo.robot import arm_state, goto, homing
from armtempo.robot.stop_request import StopRequest
from armtempo.simulator import LaunchOptions, edgelog, launch

PAPER = Arm.paper()
SWITCH = """
[joint.switches]
low = 1
active = "low"
low_deg = {angle}
"""


def switched_arm(folder: Path, angle: float = -9.0) -> Arm:
    """The paper's arm with a switch at the low end of joint 1."""
    text = shipped.arm_path().read_text()
    parts = text.split("[[joint]]")
    parts[1] += SWITCH.format(angle=angle)
    (folder / "arm.toml").write_text("[[joint]]".join(parts))
    return Arm.load(folder / "arm.toml")


@contextmanager
def unhomed(found: Arm, real: Arm | None = None) -> Iterator[tuple[Client, StopRequest]]:
    """A virtual board set up for an arm; ``real``: what its motors move instead."""
    with launch(LaunchOptions(arm=real or found)) as virtual, open_board(virtual.port) as board:
        arm_state.configure(board, found, replace=True)
        with StopRequest() as stop:
            yield board, stop


@pytest.mark.parametrize("angle", [-9.0, -12.0])
def test_homing_run_finds_where_the_arm_stands(tmp_path: Path, angle: float) -> None:
    found = switched_arm(tmp_path, angle)
    with unhomed(found) as (board, stop):
        arm_state.home(board, found, np.array([30.0, -60.0, 40.0]))  # wrong: it is at 0
        homing.home_to_switches(board, found, stop)
        stands_deg = arm_state.posture_deg(board, found)
    assert stands_deg == pytest.approx([0.0, -60.0, 40.0], abs=0.03)


HOMED_FROM = (-24, -141, 113, 100, -85, 185)


@pytest.mark.slow
def test_six_joints_by_their_switches(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Homing from far off ends at home; so say the board and, by their pulses, the motors."""
    found, log = Arm.load("parol6"), tmp_path / "log"
    monkeypatch.setattr(homing, "FAST", 1.0)  # as the simulation takes its time
    monkeypatch.setattr(homing, "SLOW", 0.2)
    options = LaunchOptions(arm=found, start_deg=HOMED_FROM, edge_log=log)
    with launch(options) as virtual, open_board(virtual.port) as board, StopRequest() as stop:
        arm_state.configure(board, found, replace=True)
        homing.home_to_switches(board, found, stop)
        assert board.status().known == 0b111111
        assert arm_state.posture_deg(board, found) == pytest.approx(list(found.home_deg), abs=0.02)
    (cycle,) = edgelog.read(log)
    moved_deg = [_moved_deg(cycle, joint) for joint in found.driven]
    assert np.add(HOMED_FROM, moved_deg) == pytest.approx(list(found.home_deg), abs=0.1)


def _moved_deg(cycle: edgelog.PowerCycle, joint: DrivenJoint) -> float:
    """How far the pulses have moved a joint's motor since power-up."""
    pins, channel = engine_pins.table(), joint.motor.channel - 1
    ticks, levels = cycle.pins[pins["STEP"][channel][0]]
    turns, to = cycle.pins[pins["DIR"][channel]]
    at = np.searchsorted(turns, ticks[levels == 1], side="right")
    signs = np.where(np.concatenate(([1 - to[0]], to))[at] == 1, 1, -1)
    return float(signs.sum()) * joint.motor.direction / joint.steps_per_deg


def test_switch_with_a_broken_wire(tmp_path: Path) -> None:
    with unhomed(switched_arm(tmp_path), PAPER) as (board, stop):  # the input is drawn to where it trips
        with pytest.raises(LinkError, match="degrees after it had been left"):
            homing.home_to_switches(board, switched_arm(tmp_path), stop)
        assert board.status().known == 0


def test_switch_that_trips_in_a_motion_is_a_fault(tmp_path: Path) -> None:
    found = switched_arm(tmp_path)
    with unhomed(found) as (board, stop):
        arm_state.home(board, found, np.array([20.0, -60.0, 40.0]))  # wrong by 20 degrees
        with pytest.raises(BoardError, match="limit switch"):
            goto.go_to(board, found, np.array([0.0, -60.0, 40.0]), stop)


def test_arm_without_switches() -> None:
    found = Arm.paper()
    with unhomed(found) as (board, stop), pytest.raises(InputError, match="no limit switch"):
        homing.home_to_switches(board, PAPER, stop)
