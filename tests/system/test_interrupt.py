"""Ctrl-C and SIGTERM during a run: the board comes to rest, the port is free, the run folder is readable."""

from __future__ import annotations

import signal
import time
from pathlib import Path

import pytest
from armtempo.link import open_board
from armtempo.model.plan import Plan
from armtempo.runs import reader, run_folder
from armtempo.simulator import LaunchOptions, launch

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
    run = reader.load(tmp_path / "runs" / "small-001")
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
    run = reader.load(tmp_path / "runs" / "small-001")
    assert run.repetitions[0].state == run_folder.RUNNING
    assert len(run.repetitions[0].index) >= 2


def _wait_for_lines(path: Path, count: int) -> None:
    limit = time.monotonic() + TIMEOUT_S
    while not path.is_file() or path.read_text().count("\n") < count:
        assert time.monotonic() < limit, "no samples arrived"
        time.sleep(0.02)
