"""Replay without a host, from the REPL."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from armtempo.model.arm import Arm
from armtempo.planning import point_to_point
from armtempo.records import encode

from tests import interpreters

SCRIPT = Path(__file__).parent / "scripts" / "probes" / "replay.py"


@pytest.mark.parametrize("name", interpreters.EACH)
def test_replay_from_the_repl(name: str, tmp_path: Path) -> None:
    """The first call takes the posture for the start and moves; the second finds the arm elsewhere."""
    paper_arm = Arm.paper()
    home_deg = np.array(paper_arm.home_deg)
    trajectory = point_to_point.straight("go", home_deg, home_deg + np.array([2.0, 1.0, -2.0]), paper_arm)
    (tmp_path / "armtempo").mkdir()
    (tmp_path / "armtempo" / "arm.ata").write_bytes(encode.arm_record(paper_arm))
    (tmp_path / "armtempo" / "go.atm").write_bytes(encode.motion_record(trajectory, paper_arm))
    lines = interpreters.run(name, SCRIPT, str(tmp_path), "go", heap="4M").splitlines()
    assert lines[0] == "taking the posture of the arm as the start of go"
    assert lines[1] == f"done at steps {_steps(trajectory, paper_arm)}"
    assert lines[2].split()[:4] == ["refused:", "wrong_start", "joint", "1"]
    assert lines[3].split() == ["refused:", "not_found"]


def _steps(trajectory, paper_arm):
    end = trajectory(trajectory.duration_s)
    return [round(angle * joint.steps_per_deg) for angle, joint in zip(end, paper_arm.driven, strict=True)]
