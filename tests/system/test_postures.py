"""Postures by name on the virtual board: taught into the arm file, gone to by name, passed by a job."""

from __future__ import annotations

from pathlib import Path

import armtempo
import numpy as np
import pytest
from armtempo.cli import main
from armtempo.model import shipped
from armtempo.simulator import LaunchOptions, launch
from click.testing import CliRunner

TAUGHT_DEG = (5.0, -61.0, 41.0)


def test_a_posture_is_taught_and_gone_to_by_name(tmp_path: Path) -> None:
    path = tmp_path / "arm.toml"
    path.write_text(shipped.arm_path().read_text())
    with launch(LaunchOptions(arm=armtempo.Arm.load(path))) as virtual:

        def run(*arguments: str, code: int = 0) -> str:
            result = CliRunner().invoke(main, [*arguments, "--arm", str(path), "--port", virtual.port])
            assert result.exit_code == code, result.output
            return result.output

        assert "is unknown" in run("teach", "--posture", "rack", code=1)
        run("home")
        run("goto", ",".join(map(str, TAUGHT_DEG)))
        assert "joint 1 5.01°, joint 2 -61°" in run("teach", "--posture", "rack")
        assert "[posture.rack]" in path.read_text()
        assert "did you mean 'rack'" in run("goto", "rak", code=2)
        run("goto", "home")
        assert "--replace" in run("teach", "--posture", "rack", code=2)
        run("goto", "rack")
        run("teach", "--posture", "rack", "--replace")
        arm = armtempo.Arm.load(path)
        with armtempo.connect(virtual.port, arm) as board:
            board.configure(arm)
            np.testing.assert_allclose(board.posture_deg(), TAUGHT_DEG, atol=0.02)
            board.goto("home")
            np.testing.assert_allclose(board.posture_deg(), arm.home_deg, atol=0.01)
            with pytest.raises(armtempo.InputError, match="did you mean 'rack'"):
                board.goto("rck")
