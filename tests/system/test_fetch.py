"""A run that the board's button started while no host was there, and its samples afterwards."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from armtempo.link import open_board
from armtempo.model.plan import Plan
from armtempo.runs import reader
from armtempo.simulator import InjectedFault, LaunchOptions, launch

from tests.system import boards, commandline
from tests.system.boards import armtempo


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
    fetched = reader.load(tmp_path / "runs" / "small-001")
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
