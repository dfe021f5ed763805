"""``armtempo selftest --with-motors`` on virtual boards with arms: what it sees of motors, encoders and switches."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from armtempo import connect
from armtempo.basics.errors import ArmtempoError, LinkError
from armtempo.diagnosis.finding import Level
from armtempo.model.parts import JointModel, LimitSwitches, Safety
from armtempo.robot import motor_test
from armtempo.simulator.launch_options import InjectedFault

from tests.host.arms import with_encoder
from tests.system import commandline
from tests.system.logged_boards import board, is_enabled


def press(pin: str, *moments: float) -> list[InjectedFault]:
    """Presses of a switch or the E-stop: motion, seconds into it, the same of the release, and so on."""
    pairs = zip(moments[::2], moments[1::2], strict=True)
    return [
        InjectedFault("input", at_s, int(run), name=pin, level=index % 2)
        for index, (run, at_s) in enumerate(pairs)
    ]


def test_what_the_motors_show(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An encoder reversed, a switch that never comes, after one that is still pressed when its fault is cleared. The
    drivers are on then, and the self-test without does nothing: the arm is held and homed as before; so without the
    firmware."""
    for name, value in (("_TRIES", 1), ("_SPEED", 0.5), ("SLOWEST", 0.2)):
        monkeypatch.setattr(motor_test, name, value)
    (joint,) = commandline.ARM.joints[:1]
    joint = replace(joint, model=JointModel(), switches=LimitSwitches(low=1, high=2))
    real = replace(commandline.ARM, joints=(joint,), safety=Safety(estop_fitted=True))
    named = replace(real, joints=(with_encoder(joint, direction=-1),))
    said: list[str] = []
    # Four motions of the joint, up, down to the switch, on to it, down; up, down; up to the E-stop.
    pressed = [*press("D8", 6, 0.1, 7, 0.02), *press("E15", 11, 0.1, 11, 0.2)]
    with board(tmp_path, named, arm=real, faults=pressed) as port, connect(port) as used:
        used.home(named)
        with pytest.raises(ArmtempoError, match="nothing moved"):
            used.motor_test(named, lambda _: False)
        assert not is_enabled(tmp_path)
        found = used.motor_test(named, lambda question: not said.append(question), said.append)  # type: ignore[func-returns-value]
        before = (used.status().state, used.status().positions)
        with pytest.raises(LinkError, match="drivers are on"):
            used.selftest()
        assert (used.status().state, used.status().positions) == before
        used.client._info = replace(used.info, features=0)
        with pytest.raises(LinkError, match=r"stock MicroPython.*armtempo flash"):
            used.selftest()
    assert before[0] == "idle"
    assert "joint 1 by +0.8°. Is the arm supported" in said[0]
    assert found.data["arm_file"] == ["joint 1: encoder: direction = 1"]
    lines = {line.what: (line.verdict, line.measured.split(",")[0]) for line in found.lines}
    assert lines == {
        "joint 1: direction": (Level.GOOD, "as in the arm file"),
        "joint 1: encoder": (Level.ERROR, "-9 counts for 28 steps"),
        "joint 1: backlash": (Level.NOTE, "none that its encoder shows"),
        "the switch at the low end of joint 1": (Level.GOOD, "stopped the joint"),
        "the switch at the high end of joint 1": (Level.ERROR, "not seen"),
        "the E-stop": (Level.GOOD, "stopped the joint"),
    }


def test_switches_that_are_swapped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Who presses the one at the high end stops the joint on its way down. It moves there and back as confirmed."""
    for name, value in (("_TRIES", 1), ("SLOWEST", 0.2)):
        monkeypatch.setattr(motor_test, name, value)
    monkeypatch.setattr(motor_test.MotorTest, "_joint", lambda *_: None)
    (joint,) = commandline.ARM.joints[:1]
    arm = replace(commandline.ARM, joints=(replace(joint, switches=LimitSwitches(low=1, high=2)),))
    # each in a motion down after one up; then it goes on down
    pressed = press("D8", 2, 0.1, 2, 0.1001, 5, 0.1, 5, 0.1001)
    with board(tmp_path, arm, arm=arm, faults=pressed) as port, connect(port) as used:
        used.home(arm)
        found = used.motor_test(arm, lambda _: True, lambda _: None)
        assert used.status().positions.commanded_steps == (0,)
    lines = [(line.verdict, line.measured) for line in found.lines[:2]]
    stopped = "stopped the joint"
    assert lines == [(Level.GOOD, stopped), (Level.ERROR, f"{stopped} on its way to the other end")]


def test_backlash_by_the_encoder_of_the_joint(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(motor_test, "_SPEED", 1.0)
    (joint,) = commandline.ARM.joints[:1]
    model = replace(joint.model, backlash_deg=0.3, scatter_deg=0.0)
    joint = with_encoder(replace(joint, model=model), counts_per_rev=36_000, following_error_deg=0.0)
    arm = replace(commandline.ARM, joints=(joint,))
    with board(tmp_path, arm, arm=arm) as port, connect(port) as used:
        used.home(arm)
        found = used.motor_test(arm, lambda _: True, lambda _: None)
    lines = {line.what: line for line in found.lines}
    assert lines["joint 1: encoder"].verdict is Level.GOOD
    said = lines["joint 1: backlash"].measured.split("°")[0]
    # as a motor stops, its rotor swings and pushes the joint on by 3 or 4 counts of 0.01 degrees
    assert float(said) == pytest.approx(0.3, abs=0.05)
    (line,) = found.data["arm_file"]
    assert line.startswith(f"joint 1: motor: backlash_deg = {said} or so, ")


def test_a_coupled_joint_that_turns_the_other_way(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The direction of its own motor may be right, and the other's wrong: no line for the arm file."""
    monkeypatch.setattr(motor_test, "_SPEED", 1.0)
    joints = [replace(joint, model=JointModel()) for joint in commandline.ARM.joints[:2]]
    coupled = tuple(
        replace(joint, encoder=joint.encoder and replace(joint.encoder, on="motor")) for joint in joints
    )
    arm = replace(commandline.ARM, joints=coupled, coupling=((1.0, 1.0), (1.0, -1.0)))
    with board(tmp_path, arm, arm=arm) as port, connect(port) as used:
        used.home(arm)
        found = used.motor_test(arm, lambda question: "joint 1 just" not in question, lambda _: None)
    lines = {line.what: line for line in found.lines}
    assert lines["joint 1: direction"].verdict is Level.ERROR
    assert "[coupling]" in lines["joint 1: direction"].cure
    assert [lines[f"joint {n}: encoder"].verdict for n in (1, 2)] == [Level.GOOD] * 2
    assert lines["joint 2: direction"].verdict is Level.GOOD
    assert "joint 1: backlash" not in lines
    assert not found.data["arm_file"]
