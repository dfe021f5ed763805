"""Sliding joints on the virtual board: the pins make their steps, and every command says mm."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from armtempo.cli import main
from armtempo.model import engine_pins
from armtempo.model.arm import Arm
from armtempo.simulator import LaunchOptions, edgelog, launch
from click.testing import CliRunner

from tests.host import arms

_ENCODER = "following_error_mm = 2.0 }\n"
_MODEL = """switches = { low = "PD0", low_mm = -1.0 }
[joint.model]
holding_torque_nm = 0.4
rotor_inertia_kg_m2 = 5e-6
damping_nm_s = 0.01
moved_kg = 2.0
gravity_force_n = 20.0
"""
ARM = arms.replaced(
    arms.SLIDE_AND_TURN,
    (
        "speed_mm_s = 40.0, acceleration_mm_s2 = 200.0, jerk_mm_s3 = 2000.0",
        "speed_mm_s = 100.0, acceleration_mm_s2 = 800.0, jerk_mm_s3 = 20000.0",
    ),
    (_ENCODER, _ENCODER + _MODEL),
    ("acceleration_deg_s2 = 90.0, jerk_deg_s3 = 900.0", "acceleration_deg_s2 = 900.0, jerk_deg_s3 = 9000.0"),
)
JOB = """
name = "lift"
path = "through"
optimiser = "gradient"
starts = 1
refine = 2
via_joints = [[5.0, 0.0], [20.0, 20.0]]
"""


def test_every_command_moves_a_slide_in_mm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("arm.toml").write_text(ARM)
    Path("job.toml").write_text(JOB)
    Path("armtempo.toml").write_text('arm = "arm.toml"\njob = "job.toml"\n')
    log = tmp_path / "edges"
    with launch(LaunchOptions(arm=Arm.load("arm.toml"), edge_log=log)) as virtual:
        monkeypatch.setenv("ARMTEMPO_PORT", virtual.port)
        assert "switch seen after 1.0 mm" in said("home", "--switches", "--joint", "z")
        said("home")
        assert "z is at the end" in said("jog", "--joint", "z", "--by", "-3", code=2)
        assert "5.00 mm" in said("goto", "5,0")
        done = json.loads(said("jog", "--joint", "z", "--to", "15", "--json"))["joints"]
        assert done[0]["position_mm"] == pytest.approx(15.0, abs=0.01)
        assert done[0]["encoder_mm"] == pytest.approx(15.0, abs=0.05)
        assert "angle_deg" not in done[0]
        assert "position_mm" not in done[1]
        assert done[1]["angle_deg"] == 0.0
        assert "-300 degrees" not in said("goto", "300,0", code=2)
        assert "z: 300 mm is outside of its range 0 to 200" in said("goto", "300,0", code=2)
        said("plan", "-o", "lift.json")
        said("goto", "lift.json")
        ran = said("run", "lift.json")
        assert "z (mm)" in ran
        report = json.loads(said("report", "runs/lift-001", "--json"))["runs"][0]
        assert report["verdict"] in ("good", "open")
        page = Path("runs/lift-001/report.html").read_text()
        assert "largest (mm or °)" in page
        assert "20.00 mm" in said("status")
    head = Path("runs/lift-001/samples-01.csv").read_text().splitlines()[0]
    assert "j1_commanded_mm,j1_counts,j1_position_mm,j2_commanded_steps,j2_commanded_deg" in head
    (cycle,) = edgelog.read(log)
    step = engine_pins.table()["STEP"][0][0]
    assert (cycle.pins[step][1] == 1).sum() > 100 * (200 + 5 + 10 + 10 + 15) * 0.1


def said(*arguments: Any, code: int = 0) -> str:
    done = CliRunner().invoke(main, [*map(str, arguments)])
    assert done.exit_code == code, f"{arguments}: {done.output} {done.exception!r}"
    return done.stdout if "--json" in arguments else done.output
