"""A bad cable and a pulled one, between the command line and the virtual board's process."""

from __future__ import annotations

import subprocess
import time
from dataclasses import replace
from pathlib import Path

import pytest
from armtempo import simulator
from armtempo.link import open_board
from armtempo.link.follow import Follower
from armtempo.model.arm import Arm
from armtempo.planning import point_to_point
from armtempo.records import encoded_motion
from armtempo.report import run_folder, run_reader
from armtempo.robot import arm_state, stored_motion
from armtempo.simulator import LaunchOptions, launch

from tests import interpreters
from tests.inprocess import Noise, clean
from tests.system.boards import TIMEOUT_S, armtempo, small_plan, start
from tests.system.commandline import wait_for
from tests.system.relay import Relay


def begun(port: str, folder: Path, lines: int) -> subprocess.Popen[str]:
    """A run of some seconds whose file of samples has that many lines."""
    file = small_plan(folder / "small.json", (90.0, -75.0, 50.0))
    armtempo("home", "--arm", "paper", "--port", port, cwd=folder)
    process = start("run", file, "--port", port, cwd=folder)
    path = folder / "runs" / "small-001" / "samples-01.csv"
    wait_for(lambda: path.is_file() and path.read_text().count("\n") >= lines, "the first samples")
    return process


@pytest.mark.parametrize("kind", ["lose", "double", "flip", "cut"])
def test_run_over_a_bad_cable_is_complete(tmp_path: Path, kind: str) -> None:
    file = small_plan(tmp_path / "small.json")
    to_board, from_board = Noise(f"to {kind}", 0.002, (kind,)), Noise(f"from {kind}", 0.002, (kind,))
    with launch() as board, Relay(board.port, tmp_path / "port", to_board, from_board) as relay:
        armtempo("home", "--arm", "paper", "--port", relay.port, cwd=tmp_path)
        output = armtempo("run", file, "--port", relay.port, cwd=tmp_path)
    assert "complete" in output
    assert to_board.hits + from_board.hits > 0
    samples = run_reader.load(tmp_path / "runs" / "small-001").repetitions[0]
    assert samples.index.tolist() == list(range(len(samples.index)))
    assert samples.state == run_folder.COMPLETE


def test_cable_pulled_during_a_run_and_put_back(tmp_path: Path) -> None:
    with (
        launch(LaunchOptions(virtual_time=False)) as board,
        Relay(board.port, tmp_path / "port", clean, clean) as relay,
    ):
        process = begun(relay.port, tmp_path, lines=8)
        relay.unplug()
        time.sleep(1.0)
        relay.plug()
        out, error = process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == 0, out + error
    assert "waiting for it to come back" in error
    assert "complete" in out
    samples = run_reader.load(tmp_path / "runs" / "small-001").repetitions[0]
    assert samples.index.tolist() == list(range(len(samples.index)))
    assert samples.time_s[-1] > 3.0


def test_cable_put_into_another_board_during_a_run(tmp_path: Path) -> None:
    with launch(LaunchOptions(virtual_time=False)) as board, launch(LaunchOptions(seed=1)) as other:
        armtempo("home", "--arm", "paper", "--port", other.port, cwd=tmp_path)
        with Relay(board.port, tmp_path / "port", clean, clean) as relay:
            process = begun(relay.port, tmp_path, lines=5)
        with Relay(other.port, tmp_path / "port", clean, clean):
            out, error = process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == 1, out + error
    assert error.count("waiting for it to come back") == 1
    assert "another board is on" in error


def test_interrupt_while_the_cable_is_out(tmp_path: Path) -> None:
    with (
        launch(LaunchOptions(virtual_time=False)) as board,
        Relay(board.port, tmp_path / "port", clean, clean) as relay,
    ):
        process = begun(relay.port, tmp_path, lines=5)
        relay.unplug()
        process.terminate()
        time.sleep(0.5)
        process.terminate()
        out, error = process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == 130, out + error
    assert len(run_reader.load(tmp_path / "runs" / "small-001").repetitions[0].index) >= 4


# a host that is busy for a moment: the virtual board does not run away from it


AWAY_S = 3.0
SPEED_DEG_S = 6.0
FASTEST = interpreters.starter(interpreters.AVAILABLE[min(1, len(interpreters.AVAILABLE) - 1)])


def test_samples_wait_for_a_host_that_does_not_read() -> None:
    """In virtual time a motion of a minute would be over long before the host is back."""
    shipped = Arm.paper()
    joints = [
        replace(joint, limits=replace(joint.limits, speed_deg_s=SPEED_DEG_S)) if joint.limits else joint
        for joint in shipped.joints
    ]
    arm = replace(shipped, joints=tuple(joints))
    motion = point_to_point.straight("slow", arm.home_deg, [180.0, -60.0, 40.0], arm)
    with (
        simulator.launch(simulator.LaunchOptions(interpreter=FASTEST)) as process,
        open_board(process.port) as board,
    ):
        arm_state.configure(board, arm, replace=True)
        arm_state.home(board, arm)
        stored = stored_motion.store(board, "slow", encoded_motion.of_trajectory(motion, arm).data)
        started = board.start(stored.name, stored.crc)
        assert started.duration_s > 50.0
        follower = Follower(board, started.run)
        time.sleep(AWAY_S)
        indices = [sample.index for sample in follower.samples()]
    assert follower.ended
    assert follower.end.lost == ()
    assert indices == list(range(len(indices)))
