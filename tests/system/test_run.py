"""Runs on the virtual board through the command line, as a user does them."""

from __future__ import annotations

import os
import time
from pathlib import Path

import numpy as np
import pytest
from armtempo import arm, encode, record, runs, trajectory_file
from armtempo.virtual import launch

from tests.system.boards import armtempo, small_plan


def test_demo(tmp_path: Path) -> None:
    output = armtempo("demo", cwd=tmp_path)
    run = runs.load(tmp_path / "runs" / "feed-001")
    samples = run.repetitions[0]
    plan = trajectory_file.load(tmp_path / "runs" / "feed-001" / "trajectory.json")
    assert samples.state == record.COMPLETE
    assert samples.index.tolist() == list(range(len(samples.index)))
    np.testing.assert_allclose(samples.time_s[:-1], 0.1 * np.arange(len(samples.index) - 1), atol=1e-5)
    steps_per_deg = [encode.steps_per_deg(joint) for joint in plan.arm.driven]
    end_steps = np.rint(np.array([180.0, -38.0, -52.0]) * steps_per_deg)
    assert samples.commanded_steps[-1].tolist() == end_steps.tolist()
    ideal_steps = plan.trajectory(samples.time_s) * steps_per_deg
    assert np.abs(samples.commanded_steps - ideal_steps).max() <= 0.55 + 1.0  # a sample may see a pulse begin
    assert f"{'joint 1':<12}{6400:>10}" in output
    assert (tmp_path / "runs" / "feed-001" / "report.html").is_file()
    armtempo("run", tmp_path / "runs" / "feed-001" / "trajectory.json", cwd=tmp_path)
    assert (tmp_path / "runs" / "feed-002").is_dir()


def test_board_on_a_port(tmp_path: Path) -> None:
    file = small_plan(tmp_path / "small.json")
    with launch(tmp_path / "flash") as board:

        def on_board(*arguments: str | Path, code: int = 0) -> str:
            return armtempo(*arguments, "--port", board.port, cwd=tmp_path, code=code)

        assert "armtempo home" in on_board("run", file, code=1)
        on_board("home")
        assert "20.00, -75.0" in on_board("goto", "P1")
        assert "armtempo goto" in on_board("run", file, code=1)
        on_board("goto", file)
        output = on_board("run", file, "--repeat", "2", "--log-traffic", "traffic.log")
        assert output.count("complete") == 2
        assert "upload" not in on_board("list")
        assert "small " in on_board("list")
        assert "start run=" in armtempo("monitor", "traffic.log", cwd=tmp_path)
    found = runs.load(tmp_path / "runs" / "small-001")
    first, second = found.repetitions
    np.testing.assert_array_equal(first.commanded_steps, second.commanded_steps)
    with launch(tmp_path / "flash") as board:
        assert "small " in armtempo("list", "--port", board.port, cwd=tmp_path)
        assert "position unknown" in armtempo("status", "--port", board.port, cwd=tmp_path)


def test_stored_motion_keeps_its_place_in_a_sim_folder(tmp_path: Path) -> None:
    file = small_plan(tmp_path / "small.json")
    armtempo("upload", file, "--port", "sim:flash", cwd=tmp_path)
    assert "samples-01.csv: complete" in armtempo("run", "small", "--port", "sim:flash", cwd=tmp_path)


def test_board_set_up_for_another_arm(tmp_path: Path) -> None:
    text = arm.default_path().read_text().replace("microsteps = 8", "microsteps = 16")
    (tmp_path / "other.toml").write_text(text)
    armtempo("home", "--arm", "other.toml", "--port", "sim:flash", cwd=tmp_path)
    assert "--arm" in armtempo("home", "--port", "sim:flash", cwd=tmp_path, code=1)
    armtempo("home", "--arm", "other.toml", "--port", "sim:flash", cwd=tmp_path)


def test_port_where_nobody_answers(tmp_path: Path) -> None:
    master, slave = os.openpty()
    begin_s = time.monotonic()
    try:
        output = armtempo("status", "--port", os.ttyname(slave), cwd=tmp_path, code=1)
    finally:
        os.close(master)
        os.close(slave)
    assert "does not answer within 2 s" in output
    assert "Traceback" not in output
    assert time.monotonic() - begin_s < 30  # a hang would never end


@pytest.mark.parametrize("arguments", [("run", "missing.json"), ("upload", "missing.json")])
def test_missing_file(tmp_path: Path, arguments: tuple[str, ...]) -> None:
    output = armtempo(*arguments, cwd=tmp_path, code=2)
    assert "missing.json" in output
    assert "Traceback" not in output
