"""Runs on the virtual board through the command line; Ctrl-C and SIGTERM: the arm rests, port free, folder readable."""

from __future__ import annotations

import json
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from armtempo import simulator
from armtempo.link import open_board
from armtempo.model import shipped
from armtempo.model.arm import Arm
from armtempo.model.plan import Plan
from armtempo.report import run_folder, run_reader
from armtempo.robot import arm_state
from armtempo.simulator import InjectedFault, LaunchOptions, launch

from tests.system import boards, commandline
from tests.system.boards import TIMEOUT_S, armtempo, small_plan, start

ENDS_WITHIN_S = 60.0
"""Far more than braking and freezing may take, for loaded machines."""


def test_board_on_a_port(tmp_path: Path) -> None:
    file = small_plan(tmp_path / "small.json")
    with launch(LaunchOptions(tmp_path / "flash")) as board:

        def on_board(*arguments: str | Path, code: int = 0) -> str:
            return armtempo(*arguments, "--port", board.port, cwd=tmp_path, code=code)

        assert "armtempo home" in on_board("run", file, code=1)
        on_board("home", "--arm", "paper")
        said = on_board("goto", "P1", "--job", shipped.job_path())
        assert "20.00°" in said
        assert "-75.0" in said
        assert "armtempo goto" in on_board("run", file, code=1)
        on_board("goto", file)
        output = on_board("run", file, "--repeat", "2", "--log-traffic", "traffic.log")
        assert output.count("complete") == 2
        assert "upload" not in on_board("list")
        assert "small " in on_board("list")
        assert "start run=" in armtempo("monitor", "traffic.log", cwd=tmp_path)
    found = run_reader.load(tmp_path / "runs" / "small-001")
    first, second = found.repetitions
    np.testing.assert_array_equal(first.commanded_steps, second.commanded_steps)
    with launch(LaunchOptions(tmp_path / "flash")) as board:
        assert "small " in armtempo("list", "--port", board.port, cwd=tmp_path)
        assert "position unknown" in armtempo("status", "--port", board.port, cwd=tmp_path)


def test_stored_motion_keeps_its_place_in_a_sim_folder(tmp_path: Path) -> None:
    file = small_plan(tmp_path / "small.json")
    armtempo("upload", file, "--port", "sim:flash", cwd=tmp_path)
    done = commandline.run("run", "small", "--port", "sim:flash", folder=tmp_path)
    assert "samples-01.csv: complete" in done.output
    assert done.errors.count("started for this command: its arm begins at home") == 1
    assert "started for this command" not in done.output


def test_board_set_up_for_another_arm(tmp_path: Path) -> None:
    text = shipped.arm_path().read_text().replace("microsteps = 8", "microsteps = 16")
    (tmp_path / "other.toml").write_text(text)
    armtempo("home", "--arm", "other.toml", "--port", "sim:flash", cwd=tmp_path)
    assert "give --arm" in armtempo("home", "--port", "sim:flash", cwd=tmp_path, code=2)
    refused = armtempo("home", "--arm", "paper", "--port", "sim:flash", cwd=tmp_path, code=1)
    assert "set up for a different arm" in refused
    assert "armtempo configure" in refused
    armtempo("home", "--arm", "other.toml", "--port", "sim:flash", cwd=tmp_path)


def test_live_says_where_there_is_no_display(tmp_path: Path) -> None:
    file = small_plan(tmp_path / "small.json")
    done = commandline.run("run", file, "--live", "--json", folder=tmp_path, MPLBACKEND="agg")
    assert done.exit_code == 0, done.errors
    done.said("no live plot: there is no display", "samples-01.csv: complete")
    found = json.loads(done.output)
    assert (found["complete"], found["repetitions"]) == (True, ["complete"])
    assert run_reader.load(tmp_path / found["folder"]).repetitions[0].state == "complete"


def test_fault_is_named_in_terminal_run_folder_and_report(tmp_path: Path) -> None:
    """A joint far too heavy for its motor: it loses steps, and the encoder's watch ends the run."""
    heavy = shipped.arm_path().read_text().replace("\ninertia_kg_m2 = 0.15", "\ninertia_kg_m2 = 6.0")
    (tmp_path / "heavy.toml").write_text(heavy)
    job = 'name = "throw"\nvia_deg = [[0.0, -60.0, 40.0], [30.0, -60.0, 40.0]]\niterations = 20\n'
    (tmp_path / "job.toml").write_text(job)
    armtempo("plan", "--arm", "heavy.toml", "--job", "job.toml", "-o", "throw.json", cwd=tmp_path)
    output = armtempo("run", "throw.json", cwd=tmp_path, code=1)
    assert "samples-01.csv: fault (following)" in output
    assert "joint 1" in output
    assert run_reader.load(tmp_path / "runs" / "throw-001").repetitions[0].state == "fault"
    armtempo("report", "runs/throw-001", cwd=tmp_path)
    assert "cut short, ended as fault (following)" in (tmp_path / "runs/throw-001/report.html").read_text()


@pytest.mark.parametrize("arguments", [("run", "missing.json"), ("upload", "missing.json")])
def test_missing_file(tmp_path: Path, arguments: tuple[str, ...]) -> None:
    output = armtempo(*arguments, cwd=tmp_path, code=2)
    assert "missing.json" in output
    assert "Traceback" not in output


# a run that the board's button started while no host was there, and its samples afterwards


def test_button_then_fetch(tmp_path: Path) -> None:
    """The press comes 2.5 s after a first motion's time 0: long after it."""
    file = boards.small_plan(tmp_path / "small.json")
    press = InjectedFault("input", at_s=2.5, name="A0", level=1)
    with launch(LaunchOptions(faults=[press])) as process:
        port = process.port

        def on_board(*arguments: str | Path, code: int = 0) -> str:
            return armtempo(*arguments, "--port", port, cwd=tmp_path, code=code)

        on_board("home", "1,-60,40", "--arm", "paper")
        assert "fetched" in on_board("fetch", file, code=1)
        on_board("upload", file, "--default")
        on_board("goto", file)  # the first motion
        commandline.wait_for(lambda: ran(port) == 2, "the button's run")
        assert '"repetitions": ["complete"]' in on_board("fetch", "--json")
        assert "fetched" in on_board("fetch", code=1)
    fetched = run_reader.load(tmp_path / "runs" / "small-001")
    (samples,) = fetched.repetitions
    assert samples.index.tolist() == list(range(len(samples.index)))
    plan = Plan.load(file)
    assert abs(samples.time_s[-1] - plan.trajectory.duration_s) < 1e-4
    end_deg = plan.trajectory(plan.trajectory.duration_s)
    assert np.max(np.abs(samples.commanded_deg[-1] - end_deg)) < 0.03


def ran(port: str) -> int:
    """How many runs there were, once nothing moves."""
    with open_board(port) as board:
        status = board.status()
        return 0 if status.moving else status.run


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
