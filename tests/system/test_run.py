"""Runs on the virtual board through the command line, as a user does them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from armtempo import arm, runs
from armtempo.virtual import launch

from tests.system.boards import armtempo, small_plan


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


@pytest.mark.parametrize("arguments", [("run", "missing.json"), ("upload", "missing.json")])
def test_missing_file(tmp_path: Path, arguments: tuple[str, ...]) -> None:
    output = armtempo(*arguments, cwd=tmp_path, code=2)
    assert "missing.json" in output
    assert "Traceback" not in output
