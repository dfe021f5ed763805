"""A homing run to limit switches on the virtual board, whose switches trip when the test says so."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from armtempo import arm, homing, operate
from armtempo.errors import BoardError, InputError, LinkError
from armtempo.interrupt import StopRequest
from armtempo.link import Board, open_board
from armtempo.virtual import Fault, launch

SWITCH = """
[joint.switches]
low = 1
active = "low"
low_deg = {angle}
"""


def switched_arm(folder: Path, angle: float = -9.0) -> arm.Arm:
    """The paper's arm with a switch at the low end of joint 1."""
    text = arm.default_path().read_text()
    parts = text.split("[[joint]]")
    parts[1] += SWITCH.format(angle=angle)
    (folder / "arm.toml").write_text("[[joint]]".join(parts))
    return arm.load_arm(folder / "arm.toml")


@contextmanager
def unhomed(found: arm.Arm, *faults: tuple[int, float, int]) -> Iterator[tuple[Board, StopRequest]]:
    """A virtual board set up for an arm, and the levels of its switch: (run, from seconds on, level)."""
    levels = [Fault("input", at_s, run, name="PD8", level=level) for run, at_s, level in faults]
    with launch(arm=found, faults=levels) as virtual, open_board(virtual.port) as board:
        operate.configure(board, found, replace=True)
        with StopRequest() as stop:
            yield board, stop


@pytest.mark.parametrize("angle", [-9.0, -12.0])
def test_homing_run(tmp_path: Path, angle: float) -> None:
    found = switched_arm(tmp_path, angle)
    with unhomed(found, (1, 3.0, 0), (2, 0.5, 1), (3, 1.0, 0), (4, 0.3, 1)) as (board, stop):
        operate.home(board, found)
        homing.home_to_switches(board, found, stop)
        stands_deg = operate.posture_deg(board, found)
    back_deg = homing.BACK_DEG + max(0.0, -10.0 - angle)
    assert stands_deg[0] == pytest.approx(angle + back_deg, abs=0.03)
    assert stands_deg[1:] == pytest.approx([-60.0, 40.0], abs=0.01)


def test_switch_that_never_trips(tmp_path: Path) -> None:
    found = switched_arm(tmp_path)
    with unhomed(found) as (board, stop):
        with pytest.raises(LinkError, match="did not trip"):
            homing.home_to_switches(board, found, stop)
        assert board.status().known == 0


def test_switch_that_trips_in_a_motion_is_a_fault(tmp_path: Path) -> None:
    found = switched_arm(tmp_path)
    with unhomed(found, (1, 0.5, 0)) as (board, stop):
        operate.home(board, found, np.array([20.0, -60.0, 40.0]))
        with pytest.raises(BoardError, match="limit switch"):
            operate.go_to(board, found, operate.home_deg(found), stop)


def test_arm_without_switches() -> None:
    found = arm.load_arm(arm.default_path())
    with unhomed(found) as (board, stop), pytest.raises(InputError, match="no limit switch"):
        homing.home_to_switches(board, found, stop)
