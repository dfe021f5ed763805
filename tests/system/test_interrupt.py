"""Ctrl-C and SIGTERM during a run: the board comes to rest, the port is free, the run folder is readable."""

from __future__ import annotations

import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from armtempo import simulator
from armtempo.link import open_board
from armtempo.model.arm import Arm
from armtempo.model.plan import Plan
from armtempo.report import run_folder, run_reader
from armtempo.robot import arm_state
from armtempo.simulator import InjectedFault, LaunchOptions, launch

from tests.system import commandline
from tests.system.boards import TIMEOUT_S, armtempo, small_plan, start


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_interrupted_run(tmp_path: Path, number: signal.Signals) -> None:
    file = small_plan(tmp_path / "small.json", (90.0, -75.0, 50.0))
    with launch(LaunchOptions(virtual_time=False)) as board:
        armtempo("home", "--arm", "paper", "--port", board.port, cwd=tmp_path)
        process = start("run", file, "--port", board.port, cwd=tmp_path)
        samples = tmp_path / "runs" / "small-001" / "samples-01.csv"
        _wait_for_lines(samples, 4)
        process.send_signal(number)
        out, error = process.communicate(timeout=TIMEOUT_S)
        assert process.returncode == 130, out + error
        assert "interrupted" in error
        assert "Traceback" not in error
        with open_board(board.port) as found:
            status = found.status()
    assert not status.moving
    run = run_reader.load(tmp_path / "runs" / "small-001")
    repetition = run.meta["repetitions"][0]
    assert repetition["state"] == run_folder.INTERRUPTED
    assert len(run.repetitions[0].index) == repetition["samples"] >= 3
    assert repetition["duration_s"] < Plan.load(file).trajectory.duration_s - 0.1
    assert tuple(repetition["commanded_steps"]) == status.positions.commanded_steps


def test_killed_host_leaves_a_readable_folder_and_a_board_to_talk_to(tmp_path: Path) -> None:
    file = small_plan(tmp_path / "small.json")
    with launch(LaunchOptions(virtual_time=False)) as board:
        armtempo("home", "--arm", "paper", "--port", board.port, cwd=tmp_path)
        process = start("run", file, "--port", board.port, cwd=tmp_path)
        _wait_for_lines(tmp_path / "runs" / "small-001" / "samples-01.csv", 4)
        process.kill()
        process.communicate()
        assert "state" in armtempo("stop", "--port", board.port, cwd=tmp_path)
    run = run_reader.load(tmp_path / "runs" / "small-001")
    assert run.repetitions[0].state == run_folder.RUNNING
    assert len(run.repetitions[0].index) >= 2


def _wait_for_lines(path: Path, count: int) -> None:
    limit = time.monotonic() + TIMEOUT_S
    while not path.is_file() or path.read_text().count("\n") < count:
        assert time.monotonic() < limit, "no samples arrived"
        time.sleep(0.02)


# interrupts that meet a board that has fallen silent, or a user in a hurry


ENDS_WITHIN_S = 60.0
"""Far more than braking and freezing may take, for loaded machines."""


@contextmanager
def board_at_home(*faults: InjectedFault) -> Iterator[simulator.VirtualBoard]:
    """A virtual board in real time whose arm is at home."""
    arm = Arm.paper()
    with simulator.launch(simulator.LaunchOptions(arm=arm, virtual_time=False, faults=faults)) as process:
        with open_board(process.port) as board:
            arm_state.configure(board, arm, replace=True)
            arm_state.home(board, arm)
        yield process


def samples_in(folder: Path) -> int:
    """Whole sample lines of the one run in ``folder``."""
    return sum(path.read_text().count("\n") for path in folder.glob("*-001/samples-01.csv"))


def long_plan(folder: Path) -> Path:
    """A motion of some seconds from home."""
    return small_plan(folder / "feed.json", (170.0, -10.0, -50.0), "feed")


def test_sigterm_ends_a_run_whose_board_has_fallen_silent(tmp_path: Path) -> None:
    with board_at_home(InjectedFault("silence", at_s=0.5, ms=1e9)) as process:
        command = commandline.start(
            "run", long_plan(tmp_path), "--port", process.port, "--out", tmp_path, folder=tmp_path
        )
        commandline.wait_for(lambda: samples_in(tmp_path) > 3, "the first samples")
        command.terminate()
        done = commandline.ended(command, ENDS_WITHIN_S)
    done.said("armtempo: the board was told to stop but still moves", "switch off")
    assert done.exit_code == 1
    assert run_reader.load(tmp_path / "feed-001").meta["repetitions"][0]["state"] == "broken"


def test_a_second_ctrl_c_ends_it_at_once(tmp_path: Path) -> None:
    with board_at_home() as process:
        command = commandline.start(
            "run", long_plan(tmp_path), "--port", process.port, "--out", tmp_path, folder=tmp_path
        )
        commandline.wait_for(lambda: samples_in(tmp_path) > 5, "the first samples")
        command.send_signal(signal.SIGINT)
        commandline.wait_for(lambda: samples_in(tmp_path) > 7 or command.poll() == 130, "the brakes")
        command.send_signal(signal.SIGINT)
        done = commandline.ended(command, ENDS_WITHIN_S)
        with open_board(process.port) as board:
            assert not board.status().moving
    done.said("interrupted")
    assert done.exit_code == 130
    assert run_reader.load(tmp_path / "feed-001").meta["repetitions"][0]["state"] == "interrupted"
