"""Runs through the command line, and interrupts: from the first import on, in a run, while the board is silent."""

from __future__ import annotations

import json
import random
import re
import signal
import subprocess
import sys
import time
import tomllib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from armtempo import simulator
from armtempo.cli import raised_by_signals
from armtempo.link import open_board
from armtempo.model import shipped
from armtempo.model.arm import Arm
from armtempo.model.plan import Plan
from armtempo.planning import point_to_point
from armtempo.report import run_folder, run_reader
from armtempo.robot import arm_state
from armtempo.simulator import InjectedFault, LaunchOptions, launch

from tests.interpreters import ROOT
from tests.system import commandline
from tests.system.commandline import SLOW_S, armtempo, small_plan, start

ENDS_WITHIN_S = 60.0
"""Far more than braking and freezing may take, for loaded machines."""


@pytest.mark.long
def test_board_on_a_port(tmp_path: Path) -> None:
    file = small_plan(tmp_path / "small.json")
    with launch(LaunchOptions(tmp_path / "flash")) as board:

        def on_board(*arguments: str | Path, code: int = 0) -> str:
            return armtempo(*arguments, "--port", board.port, folder=tmp_path, code=code)

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
        assert "start run=" in armtempo("monitor", "traffic.log", folder=tmp_path)
    found = run_reader.load(tmp_path / "runs" / "small-001")
    first, second = found.repetitions
    np.testing.assert_array_equal(first.commanded_steps, second.commanded_steps)
    with launch(LaunchOptions(tmp_path / "flash")) as board:
        assert "small " in armtempo("list", "--port", board.port, folder=tmp_path)
        assert "position unknown" in armtempo("status", "--port", board.port, folder=tmp_path)


def test_stored_motion_keeps_its_place_in_a_sim_folder(tmp_path: Path) -> None:
    file = small_plan(tmp_path / "small.json")
    armtempo("upload", file, "--port", "sim:flash", folder=tmp_path)
    done = commandline.run("run", "small", "--port", "sim:flash", folder=tmp_path)
    assert "samples-01.csv: complete" in done.output
    assert done.errors.count("started for this command; its arm is where it was left") == 1
    assert "started for this command" not in done.output


def test_a_sim_folder_keeps_where_the_arm_stands(tmp_path: Path) -> None:
    """One with backlash: who declares where it stands is told that the side of its play is unknown, until it moves."""
    text = shipped.files()["ar4"].read_text()
    (tmp_path / "ar4.toml").write_text(text.replace("motor = {", "motor = { backlash_deg = 0.1,", 1))

    def sim(*arguments: str) -> str:
        return armtempo(*arguments, "--arm", "ar4.toml", "--port", "sim:flash", folder=tmp_path)

    kept = tmp_path / "flash-position.json"
    done = commandline.run("home", "1,2,3,4,5,6", "--arm", "ar4.toml", "--port", "sim:flash", folder=tmp_path)
    assert "joint 1: the first move may lose up to the backlash" in done.errors.replace("\n", " ")
    moved = kept.read_text()
    assert re.search(r"joint 1 +1\.00° .*encoder 1\.00°", sim("status"))
    assert kept.read_text() == moved
    sim("goto", "2,2,3,4,5,6")
    assert re.search(r"joint 1 +2\.00°", sim("status"))
    other = armtempo("status", "--arm", "paper", "--port", "sim:flash", folder=tmp_path)
    assert "joint 1" in other
    kept.write_text(moved.replace("[", "[nothing"))
    assert "position unknown" in sim("status")
    assert not kept.exists()


def test_a_trajectory_of_ros_runs_on_its_own_times(tmp_path: Path) -> None:
    """Slower than its limits allow; with --json its notes and progress go aside."""
    arm = Arm.paper()
    move = point_to_point.straight("move", (0, -60, 40), (8, -63, 37), arm)
    times = np.linspace(0.0, 1.3 * move.duration_s, 30)
    points = [
        {"positions": row, "time_from_start": at}
        for row, at in zip(np.radians(move(times / 1.3)).tolist(), times.tolist(), strict=True)
    ]
    message = {"joint_names": [joint.name for joint in arm.driven], "points": points}
    (tmp_path / "feed.json").write_text(json.dumps(message))
    done = commandline.run("run", "feed.json", "--arm", "paper", "--json", folder=tmp_path)
    assert done.exit_code == 0, done.errors
    done.said("samples-01.csv: complete")
    assert "follows the recording on its own times" in done.errors.replace("\n", " ")
    found = json.loads(done.output)
    assert (found["complete"], found["repetitions"]) == (True, ["complete"])
    run = run_reader.load(tmp_path / found["folder"]).repetitions[0]
    assert run.state == "complete"
    assert run.time_s[-1] == pytest.approx(times[-1], abs=0.1)
    wanted = move(np.minimum(run.time_s / 1.3, move.duration_s))
    assert np.abs(run.commanded_deg - wanted).max() < 0.2


# a run that the board's button started while no host was there, and its samples afterwards


def test_button_then_fetch(tmp_path: Path) -> None:
    """The press comes 2.5 s after a first motion's time 0: long after it."""
    file = commandline.small_plan(tmp_path / "small.json")
    press = InjectedFault("input", at_s=2.5, name="A0", level=1)
    with launch(LaunchOptions(faults=[press])) as process:
        port = process.port

        def on_board(*arguments: str | Path, code: int = 0) -> str:
            return armtempo(*arguments, "--port", port, folder=tmp_path, code=code)

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


def samples_in(folder: Path) -> int:
    """Whole sample lines of the one run in ``folder``."""
    return sum(path.read_text().count("\n") for path in folder.glob("*-001/samples-01.csv"))


@pytest.mark.long
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_interrupted_run(tmp_path: Path, number: signal.Signals) -> None:
    file = small_plan(tmp_path / "small.json", (90.0, -75.0, 50.0))
    with launch(LaunchOptions(virtual_time=False, instant_flash=True)) as board:
        armtempo("home", "--arm", "paper", "--port", board.port, folder=tmp_path)
        process = start("run", file, "--port", board.port, folder=tmp_path)
        commandline.wait_for(lambda: samples_in(tmp_path / "runs") > 3, "the first samples")
        process.send_signal(number)
        out, error = process.communicate(timeout=SLOW_S)
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
    with launch(LaunchOptions(virtual_time=False, instant_flash=True)) as board:
        armtempo("home", "--arm", "paper", "--port", board.port, folder=tmp_path)
        process = start("run", file, "--port", board.port, folder=tmp_path)
        commandline.wait_for(lambda: samples_in(tmp_path / "runs") > 3, "the first samples")
        process.kill()
        process.communicate()
        assert "state" in armtempo("stop", "--port", board.port, folder=tmp_path)
    run = run_reader.load(tmp_path / "runs" / "small-001")
    assert run.repetitions[0].state == run_folder.RUNNING
    assert len(run.repetitions[0].index) >= 2


# interrupts that meet a board that has fallen silent, or a user in a hurry


@contextmanager
def board_at_home(*faults: InjectedFault) -> Iterator[simulator.VirtualBoard]:
    """A virtual board in real time whose arm is at home."""
    arm = Arm.paper()
    options = simulator.LaunchOptions(arm=arm, virtual_time=False, instant_flash=True, faults=faults)
    with simulator.launch(options) as process:
        with open_board(process.port) as board:
            arm_state.configure(board, arm, replace=True)
            arm_state.home(board, arm)
        yield process


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


# ctrl-C while the command is still being imported: quiet, with exit code 130, as at any later time


START = pytest.mark.xdist_group("start")  # what they share is made once

IMPORTING = (sys.executable, "-X", "importtime", "-c", "from armtempo.__main__ import main; main()", "plan")
SHORT = ("--iterations", "1", "--population", "4")
ENDLESS = ("--iterations", "1000000")
SAID = "no arm and no job given; using the shipped feeding job and arm\n"
MOMENTS = 8
SEED = 20266


class Watched:
    """The command with ``options``, run to its end; ``at(process)`` is called when it has imported ``after`` modules.

    They are counted from the one that follows ``armtempo.__main__``: only then the command surely minds the signal.
    """

    def __init__(
        self,
        folder: Path,
        options: tuple[str, ...],
        after: int = 0,
        at: Callable[[subprocess.Popen[str]], None] = lambda process: None,
        prepare: Callable[[], object] | None = None,
    ) -> None:
        self.first: list[str] = []
        self.imported: list[str] = []
        self.errors = ""
        with subprocess.Popen(
            [*IMPORTING, *options],
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
            preexec_fn=prepare,
        ) as process:
            assert process.stderr is not None
            for line in process.stderr:
                if not line.startswith("import time:"):
                    self.errors += line
                    continue
                begun = "armtempo.__main__" in self.first
                (self.imported if begun else self.first).append(line.rsplit("|", 1)[1].strip())
                if begun and len(self.imported) == after:
                    at(process)
        self.exit_code = process.returncode


def interrupt(process: subprocess.Popen[str]) -> None:
    """Ctrl-C."""
    process.send_signal(signal.SIGINT)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Watched:
    """A run that nobody interrupts."""
    run = Watched(tmp_path_factory.mktemp("whole"), SHORT)
    assert run.exit_code == 0, run.errors
    return run


def test_the_installed_command_begins_there() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert project["scripts"] == {"armtempo": "armtempo.__main__:main"}


@START
def test_little_is_imported_before_an_interrupt_is_minded(whole: Watched) -> None:
    ours = [name for name in whole.first if name.startswith("armtempo")]
    assert ours == ["armtempo", "armtempo.basics", "armtempo.basics.errors", "armtempo.__main__"]
    assert {"click", "numpy", "armtempo.planning.planner"} <= set(whole.imported)


@pytest.mark.long
@pytest.mark.parametrize("number", range(MOMENTS))
@START
def test_an_interrupt_during_the_imports_ends_it_quietly(number: int, whole: Watched, tmp_path: Path) -> None:
    most = whole.imported.index("armtempo.planning.planner")  # what comes after it, comes after the search
    after = 1 + int((number + random.Random(SEED + number).random()) / MOMENTS * most)
    run = Watched(tmp_path, ENDLESS, after, interrupt)
    what = f"seed {SEED}, after {whole.imported[after - 1]}, module {after}"
    assert run.exit_code == 130, f"{what}: {run.errors}"
    assert run.errors.removeprefix(SAID) == "armtempo: interrupted\n", what
    assert not list(tmp_path.iterdir()), what


@pytest.mark.long
@START
def test_in_the_background_ctrl_c_stays_ignored(whole: Watched, tmp_path: Path) -> None:
    for after in (len(whole.imported) // 10, len(whole.imported) // 2):
        run = Watched(tmp_path, SHORT, after, interrupt, lambda: signal.signal(signal.SIGINT, signal.SIG_IGN))
        assert run.exit_code == 0, run.errors


def test_an_interrupt_waits_for_the_end_of_an_import(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is imported here would swallow it; what comes then would take a minute."""
    (tmp_path / "swallowing.py").write_text(
        "import signal, time\n"
        "swallowed = False\n"
        "try:\n"
        "    signal.raise_signal(signal.SIGINT)\n"
        "    time.sleep(0.1)\n"
        "except BaseException:\n"
        "    swallowed = True\n"
    )
    monkeypatch.syspath_prepend(tmp_path)

    def import_and_sleep() -> None:
        assert not import_module("swallowing").swallowed
        time.sleep(1200.0)

    handler = signal.getsignal(signal.SIGINT)
    begin_s = time.monotonic()
    with pytest.raises(KeyboardInterrupt), raised_by_signals():
        import_and_sleep()
    assert time.monotonic() - begin_s < 600.0
    assert signal.getsignal(signal.SIGINT) == handler
