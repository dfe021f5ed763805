"""Switches by which a joint cannot be homed are told before anything moves, by the host and for the board."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

import pytest
from armtempo.basics.errors import InputError
from armtempo.diagnosis import wiring
from armtempo.diagnosis.finding import Level
from armtempo.link import Client
from armtempo.model import home_switches
from armtempo.model.arm import Arm
from armtempo.model.parts import LimitSwitches
from armtempo.robot import homing
from armtempo.robot.stop_request import StopRequest

PAPER = Arm.paper()
"""Joint 1 has a range of -10 to 190 degrees and its home at 0."""
LOW = LimitSwitches(low=1, low_deg=-11.0)
OTHERS = {1: LimitSwitches(low=2, low_deg=-171.0), 2: LimitSwitches(high=3, high_deg=101.0)}


def switched(switches: dict[int, LimitSwitches], **changes: Any) -> Arm:
    joints = [
        replace(joint, switches=switches.get(index, LimitSwitches()))
        for index, joint in enumerate(PAPER.joints)
    ]
    return replace(PAPER, joints=tuple(joints), **changes)


@pytest.mark.parametrize(
    ("switches", "homed", "said"),
    [
        ({0: LimitSwitches(low=1, high=1, low_deg=-11.0, high_deg=191.0)}, (), "both its switches are on input 1"),
        ({0: LimitSwitches(low="PD0", high="PD0", low_deg=-11.0)}, (), "both its switches are on input PD0"),
        ({0: LimitSwitches(low=1, high=2, low_deg=100.0, high_deg=50.0)}, (), "at 100 deg, not below its high one"),
        ({0: LimitSwitches(low=1, low_deg=300.0)}, (), "its low switch trips at 300 deg, in all of its range"),
        ({0: LimitSwitches(high=1, high_deg=-50.0)}, (), "its high switch trips at -50 deg, in all of its range"),
        ({0: LimitSwitches(high=1, high_deg=5000.0)}, (), "at 5000 deg, farther away than all of its range"),
        ({0: LimitSwitches(low=1, low_deg=5.0)}, (), "at 5 deg, but its home is at 0, beyond it"),
        ({0: LimitSwitches(low="PD0", low_deg=5.0)}, (), "its home is at 0, beyond it"),
        ({0: replace(LOW, high=2, high_deg=-5.0)}, (), "its high switch trips at -5 deg, but its home is at 0"),
        ({0: LOW, 1: LimitSwitches(low=1, low_deg=-171.0)}, (("joint 1", "joint 2"),), "on input 1, as that of"),
    ],
)  # fmt: skip
def test_what_cannot_be_homed_is_refused_and_found_by_check(
    switches: dict[int, LimitSwitches], homed: tuple[tuple[str, ...], ...], said: str
) -> None:
    arm = switched({**OTHERS, **switches}, homing=homed)
    (problem,) = home_switches.problems(arm)
    assert said in problem.what
    assert problem.what in [each.what for each in wiring.findings(arm) if each.level is Level.ERROR]
    with pytest.raises(InputError, match=said), StopRequest() as stop:
        homing.home_to_switches(cast("Client", None), arm, stop)
    with pytest.raises(InputError, match=said):
        home_switches.check_board_can_home(arm)


@pytest.mark.parametrize(
    "switches",
    [
        LOW,
        LimitSwitches(low=1, low_deg=-10.0),
        LimitSwitches(low=1, low_deg=0.0),
        LimitSwitches(low=1, low_deg=-60.0),
        LimitSwitches(low=1, high=2, low_deg=-11.0, high_deg=191.0),
        LimitSwitches(low=1, high=2, low_deg=-11.0),
        LimitSwitches(high="PD0", high_deg=100.0),
    ],
)
def test_other_switches_will_do(switches: LimitSwitches) -> None:
    assert not home_switches.problems(switched({0: switches}))


def test_joints_that_share_an_input_are_homed_one_after_the_other() -> None:
    assert not home_switches.problems(switched({0: LOW, 1: LimitSwitches(high=1, high_deg=11.0)}))


def test_other_joints_problems_do_not_keep_one_from_being_homed() -> None:
    home_switches.check(switched({0: LOW, 1: LimitSwitches(low=1, low_deg=300.0)}), [0])


def test_a_joint_in_homing_that_has_no_switch_is_found_by_check() -> None:
    found = wiring.findings(switched({0: LOW}, homing=(("joint 1",), ("joint 4",))))
    assert [each.where for each in found if "is in 'homing'" in each.what] == ["joint 4"]
