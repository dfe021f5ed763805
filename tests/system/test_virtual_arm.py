"""The virtual arm: its motors, what they make of whole motions, homing to switches, and the faults it can suffer."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import armtempo
import numpy as np
import pytest
from armtempo.basics.errors import BoardError, InputError, LinkError
from armtempo.encoding import encode
from armtempo.link import Client, open_board
from armtempo.link.board_messages import Sample, Status
from armtempo.link.follow import RunEnd
from armtempo.model import engine_pins, home_switches, shipped
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.parts import DrivenJoint, JointModel
from armtempo.planning import planner, point_to_point
from armtempo.planning.jog.jog_motion import move_of
from armtempo.robot import arm_state, goto, homing, jog, running
from armtempo.robot.stop_request import StopRequest
from armtempo.robot.store import store
from armtempo.simulator import InjectedFault, LaunchOptions, edgelog, launch
from armtempo_shared.limits import TICK_HZ
from armtempo_shared.wire import ERROR_CODES
from numpy.typing import NDArray

from tests import scripted
from tests.inprocess import replay
from tests.system import commandline

SCRIPT = Path(__file__).parent / "scripts" / "cases" / "virtual_arm.py"
FINE_COUNTS = 400_000
"""Counts per revolution of an encoder that shows what the paper's cannot."""
TARGET_DEG = np.array([30.0, -85.0, 60.0])
GUARDED = replace(commandline.ARM, safety=replace(commandline.ARM.safety, estop_fitted=True))


@pytest.mark.long
@scripted.each(scripted.cases(SCRIPT))
def test_motor(case: scripted.Case) -> None:
    case.run()


def first_joint(arm: Arm, **changed: object) -> Arm:
    """The arm with some things of its first joint changed."""
    return replace(arm, joints=(replace(arm.joints[0], **changed), *arm.joints[1:]))  # type: ignore[arg-type]


def swing_deg(degree: int) -> float:
    """How far joint 1 swings about its command in the first 0.6 s of the feeding motion."""
    encoder = commandline.ARM.joints[0].encoder
    assert encoder is not None
    model = replace(commandline.ARM.joints[0].model, backlash_deg=0.0, scatter_deg=0.0)
    arm = first_joint(commandline.ARM, encoder=replace(encoder, counts_per_rev=FINE_COUNTS), model=model)
    job = replace(Job.paper(arm), degree=degree, iterations=50)
    trajectory = planner.plan(arm, job).trajectory
    samples: list[Sample] = []
    with launch(LaunchOptions(arm=arm)) as process, open_board(process.port) as board, StopRequest() as stop:
        arm_state.configure(board, arm, replace=True)
        arm_state.home(board, arm)
        stored = store(board, [("feed", encode.motion_record(trajectory, arm))])
        replay(board, stored, stop, samples.append)
    commanded_deg = trajectory(np.array([sample.ticks / TICK_HZ for sample in samples]))[:, 0]
    seen_deg = np.array([sample.positions.counts[0] for sample in samples]) * 360 / FINE_COUNTS
    return float(np.max(np.abs(seen_deg - commanded_deg)[1:7]))


@pytest.mark.long
def test_cubic_starts_ring_more_than_quintic_ones() -> None:
    """As section 4.2 of the paper finds of its arm; by how much is in host/docs/measurements.md."""
    quintic_deg, cubic_deg = swing_deg(5), swing_deg(3)
    assert 0.0 < 1.5 * quintic_deg < cubic_deg, (quintic_deg, cubic_deg)


def short_motion(arm: Arm) -> bytes:
    """From home."""
    return encode.motion_record(point_to_point.straight("move", np.array(arm.home_deg), TARGET_DEG, arm), arm)


def run(
    *faults: InjectedFault, arm: Arm = commandline.ARM, model: Arm | None = None, log: Path | None = None
) -> tuple[RunEnd, Status]:
    """A short motion from home, and how the board stands after it."""
    with (
        launch(LaunchOptions(faults=faults, arm=model, edge_log=log)) as process,
        open_board(process.port) as board,
    ):
        arm_state.configure(board, arm, replace=True)
        arm_state.home(board, arm)
        stored = store(board, [("move", short_motion(arm))])
        with StopRequest() as stop:
            end = replay(board, stored, stop)
        return end, board.status()


def code(end: RunEnd) -> str:
    """Name of the fault that ended a run, or nothing."""
    return running.fault_name(end.fault) if end.fault else ""


def test_without_a_fault_it_ends_where_it_was_to() -> None:
    end, status = run()
    steps = np.array([joint.steps_per_deg for joint in commandline.ARM.driven])
    assert not end.fault
    assert np.all(np.abs(np.array(status.positions.commanded_steps) - TARGET_DEG * steps) <= 0.5)


@pytest.mark.parametrize(
    ("fault", "ends", "joint"),
    [
        (InjectedFault("stall", at_s=0.4, ms=10), "", None),
        (InjectedFault("stall", at_s=0.3, ms=1500), "underrun", None),
        (InjectedFault("block", at_s=0.3, joint=1), "following", 1),
        (InjectedFault("slip", at_s=0.5, joint=2, counts=-60), "following", 2),
        (InjectedFault("crash", at_s=0.5), "internal", None),
    ],
)
def test_a_fault_ends_the_run_by_its_name(fault: InjectedFault, ends: str, joint: int | None) -> None:
    end, status = run(fault)
    assert code(end) == ends
    assert joint is None or end.fault_joint == joint
    if ends == "underrun":
        assert status.known == 7
    if ends == "internal":
        assert "injected crash" in end.notices[0]


@pytest.mark.parametrize(
    ("compensated_deg", "lost_deg"), [(0.5, 0.0), pytest.param(0.0, 0.5, marks=pytest.mark.long)]
)
def test_the_motor_crosses_the_backlash(compensated_deg: float, lost_deg: float) -> None:
    """There and back, by an encoder on the joint: it stands as far from its command after both, though the board gets
    other limits in between, and after a jog that is shorter than the backlash."""
    plain = commandline.ARM.joints[0]
    assert plain.encoder is not None
    assert plain.motor is not None
    arm = first_joint(
        commandline.ARM,
        encoder=replace(plain.encoder, counts_per_rev=FINE_COUNTS),
        motor=replace(plain.motor, backlash_deg=compensated_deg),
        model=replace(plain.model, backlash_deg=0.5, scatter_deg=0.0),
    )
    places = np.array(arm.home_deg), TARGET_DEG
    slower = replace(arm, safety=replace(arm.safety, link_timeout_ms=arm.safety.link_timeout_ms + 1))
    off_deg = []
    with launch(LaunchOptions(arm=arm)) as process, open_board(process.port) as board, StopRequest() as stop:
        arm_state.configure(board, arm, replace=True)
        arm_state.home(board, arm)
        for here, there in (places, places[::-1]):
            record = encode.motion_record(point_to_point.straight("move", here, there, arm), arm)
            end = replay(board, store(board, [("move", record)], replace=True), stop)
            assert not end.fault
            arm = slower
            arm_state.configure(board, arm, replace=True)  # which declares the encoder, too
            positions = board.status().positions
            assert abs(positions.commanded_steps[0] - there[0] * arm.driven[0].steps_per_deg) <= 0.5
            off_deg.append(positions.counts[0] * 360 / FINE_COUNTS - there[0])
        jog.step(board, arm, move_of(arm, "joint 1", None, 0.2, None), 1.0, stop)
        moved_deg = board.status().positions.counts[0] * 360 / FINE_COUNTS - places[0][0] - off_deg[1]
    near_deg = 2.0 / arm.driven[0].steps_per_deg
    assert off_deg[1] - off_deg[0] == pytest.approx(lost_deg, abs=near_deg)
    assert moved_deg == pytest.approx(0.0 if lost_deg else 0.2, abs=near_deg)


def test_estop_freezes_within_20_us(tmp_path: Path) -> None:
    """At any moment: ``case_estop_anywhere`` of engine_faults.py."""
    log = tmp_path / "edges"
    end, _ = run(InjectedFault("input", at_s=0.41, name="E15", level=0), arm=GUARDED, log=log)
    assert code(end) == "estop"
    pins = edgelog.read(log)[-1].motion()
    (tripped,) = pins["E15"][0]
    for pin in ("A15", "A1", "B10"):
        ticks, levels = pins.get(pin, (np.array([], int), np.array([], int)))
        late = ticks[ticks > tripped + 20 * 84]
        assert len(late) <= 1  # the end of a pulse that had begun
        assert not levels[ticks > tripped + 20 * 84].any()


def test_hang_makes_the_watchdog_bite() -> None:
    with (
        launch(LaunchOptions(faults=[InjectedFault("hang", at_s=0.3)])) as process,
        open_board(process.port) as board,
    ):
        arm_state.configure(board, commandline.ARM, replace=True)
        arm_state.home(board, commandline.ARM)
        stored = store(board, [("move", short_motion(commandline.ARM))])
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


def test_motor_driven_beyond_its_torque_loses_steps() -> None:
    heavy = replace(commandline.ARM.joints[0].model, inertia_kg_m2=6.0)
    end, _ = run(model=first_joint(commandline.ARM, model=heavy))
    assert (code(end), end.fault_joint) == ("following", 0)


def test_without_a_model_the_motors_are_ideal() -> None:
    joints = tuple(replace(joint, model=JointModel()) for joint in commandline.ARM.joints)
    ends = [run(model=model)[0] for model in (None, replace(commandline.ARM, joints=joints))]
    assert ends[0].positions == ends[1].positions


# A homing run to limit switches on the virtual board, whose switches trip if the arm file says so


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
def unhomed(
    found: Arm, real: Arm | None = None, start_deg: tuple[float, ...] | None = None
) -> Iterator[tuple[Client, StopRequest]]:
    """A virtual board set up for an arm; ``real``: what its motors move instead, from ``start_deg``."""
    with (
        launch(LaunchOptions(arm=real or found, start_deg=start_deg)) as virtual,
        open_board(virtual.port) as board,
    ):
        arm_state.configure(board, found, replace=True)
        with StopRequest() as stop:
            yield board, stop


@pytest.mark.long
@pytest.mark.parametrize("angle", [-9.0, -12.0])
def test_homing_run_finds_where_the_arm_stands(
    tmp_path: Path, angle: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(home_switches, "FAST", 1.0)  # as the simulation takes its time
    found = switched_arm(tmp_path, angle)
    with unhomed(found) as (board, stop):
        arm_state.home(board, found, np.array([30.0, -60.0, 40.0]))  # wrong: it is at 0
        told: list[tuple[str, int, int]] = []
        homing.home_to_switches(board, found, stop, progress=lambda *one: told.append(one))
        stands_deg = arm_state.posture_deg(board, found)
    assert stands_deg == pytest.approx([0.0, -60.0, 40.0], abs=0.03)
    assert [text for text, _, _ in told][::2] == ["joint 1: on the way to the switch", "joint 1: at home"]
    assert re.fullmatch(r"joint 1: switch seen after \d+\.\d°; once more, slowly", told[1][0])
    assert [done for _, *done in told] == [[0, 1], [0, 1], [1, 1]]


HOMED_FROM = (-24, -141, 113, 100, -85, 185)


@pytest.mark.long
@pytest.mark.slow
def test_six_joints_by_their_switches(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Homing from far off ends at home; so say the board and, by their pulses, the motors."""
    found, log = Arm.load("parol6"), tmp_path / "log"
    monkeypatch.setattr(home_switches, "FAST", 1.0)  # as the simulation takes its time
    monkeypatch.setattr(home_switches, "SLOW", 0.2)
    options = LaunchOptions(arm=found, start_deg=HOMED_FROM, edge_log=log)
    with launch(options) as virtual, open_board(virtual.port) as board, StopRequest() as stop:
        arm_state.configure(board, found, replace=True)
        homing.home_to_switches(board, found, stop)
        assert board.status().known == 0b111111
        assert arm_state.posture_deg(board, found) == pytest.approx(list(found.home_deg), abs=0.02)
    (cycle,) = edgelog.read(log)
    moved_deg = [_moved_deg(cycle, joint) for joint in found.driven]
    assert np.add(HOMED_FROM, moved_deg) == pytest.approx(list(found.home_deg), abs=0.1)


@pytest.mark.long
@pytest.mark.parametrize("start", [6.0, -8.0])
def test_homing_crosses_the_backlash(tmp_path: Path, start: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """By its pulses the joint ends at home, too, which is a little off the switch, or far."""
    found, log = switched_arm(tmp_path), tmp_path / "log"
    (joint,) = found.joints[:1]
    assert joint.motor is not None
    motor, model = (
        replace(joint.motor, backlash_deg=1.0),
        replace(joint.model, backlash_deg=1.0, scatter_deg=0.0),
    )
    found = first_joint(found, motor=motor, model=model, home_deg=start)
    monkeypatch.setattr(home_switches, "FAST", 1.0)  # as the simulation takes its time
    monkeypatch.setattr(home_switches, "SLOW", 0.2)
    with launch(LaunchOptions(arm=found, edge_log=log)) as virtual, open_board(virtual.port) as board:
        arm_state.configure(board, found, replace=True)
        with StopRequest() as stop:
            homing.home_to_switches(board, found, stop)
    (cycle,) = edgelog.read(log)
    signs = step_signs(cycle, found.driven[0])
    play = found.driven[0].steps_per_deg
    motor_steps, joint_steps = 0, 0.0
    for sign in signs:
        motor_steps += sign
        joint_steps = min(max(joint_steps, motor_steps - play / 2), motor_steps + play / 2)
    assert joint_steps / play == pytest.approx(0.0, abs=0.1)


def _moved_deg(cycle: edgelog.PowerCycle, joint: DrivenJoint) -> float:
    """How far the pulses have moved a joint's motor since power-up."""
    return float(step_signs(cycle, joint).sum()) / joint.steps_per_deg


def step_signs(cycle: edgelog.PowerCycle, joint: DrivenJoint) -> NDArray[np.int64]:
    """Of each step of a joint's motor since power-up, whether the joint's angle becomes larger (1) or smaller (-1)."""
    pins, channel = engine_pins.table(), joint.motor.channel - 1
    ticks, levels = cycle.pins[pins["STEP"][channel][0]]
    turns, to = cycle.pins[pins["DIR"][channel]]
    at = np.searchsorted(turns, ticks[levels == 1], side="right")
    return joint.motor.direction * np.where(np.concatenate(([1 - to[0]], to))[at] == 1, 1, -1)


def test_switch_with_a_broken_wire(tmp_path: Path) -> None:
    with unhomed(switched_arm(tmp_path), PAPER) as (board, stop):  # the input is drawn to where it trips
        with pytest.raises(LinkError, match="joint 1: its limit switch is still pressed 12 degrees away"):
            homing.home_to_switches(board, switched_arm(tmp_path), stop)
        assert board.status().known == 0


@pytest.mark.long
@pytest.mark.parametrize("start", [190.5, -10.0, -12.0, -17.0])
def test_homing_from_beyond_the_range_and_from_beyond_the_switch(
    tmp_path: Path, start: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The range is -10 to 190, the switch at -11.5."""
    found = switched_arm(tmp_path, -11.5)
    monkeypatch.setattr(home_switches, "FAST", 1.0)  # as the simulation takes its time
    monkeypatch.setattr(home_switches, "SLOW", 0.2)
    with unhomed(found, start_deg=(start, -60.0, 40.0)) as (board, stop):
        arm_state.home(board, found)  # wrong: joint 1 is elsewhere
        homing.home_to_switches(board, found, stop)
        assert arm_state.posture_deg(board, found) == pytest.approx([0.0, -60.0, 40.0], abs=0.03)


def test_homing_to_a_switch_of_the_other_level_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(home_switches, "FAST", 1.0)
    found = switched_arm(tmp_path)
    first = found.joints[0]
    other = replace(first, switches=replace(first.switches, active="high"))
    with unhomed(found, replace(found, joints=(other, *found.joints[1:]))) as (board, stop):
        with pytest.raises(LinkError, match=r"its level \('active' in the arm file\) is probably inverted"):
            homing.home_to_switches(board, found, stop)
        assert board.status().known == 0


def test_switch_that_trips_in_a_motion_is_a_fault(tmp_path: Path) -> None:
    found = switched_arm(tmp_path)
    with unhomed(found) as (board, stop):
        arm_state.home(board, found, np.array([20.0, -60.0, 40.0]))  # wrong by 20 degrees
        with pytest.raises(BoardError, match="limit switch"):
            goto.go_to(board, found, np.array([0.0, -60.0, 40.0]), stop)


@pytest.mark.parametrize("by_switches", [True, False])
def test_a_joint_alone_is_homed(tmp_path: Path, by_switches: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is said of the others, nor do they move."""
    monkeypatch.setattr(home_switches, "FAST", 1.0)
    found = switched_arm(tmp_path)
    with launch(LaunchOptions(arm=found)) as virtual, armtempo.connect(virtual.port, found) as board:
        if by_switches:
            board.home_to_switches(found, joint="joint 1")
            assert board.status().known == 0b001
            with pytest.raises(InputError, match="joint 2 has no limit switch"):
                board.home_to_switches(found, joint=2)
        else:
            board.home(found, joint=2)
            assert board.status().known == 0b010
            with pytest.raises(InputError, match="drives no joint 7"):
                board.home(found, joint=7)
            with pytest.raises(InputError, match="exclude each other"):
                board.home(found, "home", joint=1)


def test_arm_without_switches() -> None:
    found = Arm.paper()
    with unhomed(found) as (board, stop), pytest.raises(InputError, match="no limit switch"):
        homing.home_to_switches(board, PAPER, stop)
