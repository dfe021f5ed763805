"""Export and import: what is written says what the plan says, and comes back."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from armtempo.cli import main
from armtempo.errors import InputError
from armtempo.model import arm_file, exchange, trajectory_file
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from click.testing import CliRunner

from tests.host.made_runs import shipped_plan

ARM = Arm.paper()


def test_csv_is_the_trajectory_at_any_rate_end_included() -> None:
    plan = shipped_plan()
    rows = list(csv.DictReader(exchange.to_csv(plan, 37.0).splitlines()))
    times = np.array([float(row["time_s"]) for row in rows])
    exact = exchange.times_s(plan.trajectory.duration_s, 37.0)
    np.testing.assert_allclose(times, exact, atol=1e-9)
    assert exact[-1] == plan.trajectory.duration_s
    for order, name in enumerate(exchange.CSV_COLUMNS):
        found = np.array([[float(row[f"j{joint}_{name}"]) for joint in (1, 2, 3)] for row in rows])
        np.testing.assert_allclose(found, plan.trajectory(exact, order), atol=2e-5)


def test_ros_points_are_in_radians_and_in_order() -> None:
    plan = shipped_plan()
    text = exchange.to_ros(plan, 10.0, "base_link")
    assert "frame_id: 'base_link'" in text
    assert "joint_names: ['joint 1', 'joint 2', 'joint 3']" in text
    points = [line for line in text.splitlines() if line.startswith("- positions: ")]
    assert len(points) == len(exchange.times_s(plan.trajectory.duration_s, 10.0))
    last = [float(value) for value in points[-1].removeprefix("- positions: [").rstrip("]").split(",")]
    np.testing.assert_allclose(last, np.radians([180, -38, -52]), atol=1e-9)
    assert "time_from_start: {sec: 0, nanosec: 100000000}" in text


def test_the_start_is_there_at_any_rate() -> None:
    assert exchange.times_s(7.0, 1e-300).tolist() == [0.0, 7.0]


@pytest.mark.parametrize("rate", [0.0, -1.0, float("nan"), 1e9])
def test_an_impossible_rate_is_refused(rate: float) -> None:
    with pytest.raises(InputError, match="not allowed"):
        exchange.times_s(1.0, rate)


@pytest.mark.parametrize(
    ("text", "radians"),
    [
        ("0,-60,40\n20,-75,50\n", False),
        ("a,b,c\n0,-60,40\n\n20,-75,50\n", False),
        ("joint 3,joint 1,joint 2\n40,0,-60\n50,20,-75\n", False),
        ("time_s,j1_angle_deg,j2_angle_deg,j3_angle_deg\n9,0,-60,40\n9,20,-75,50\n", False),
        ("0,-1.0471975511965976,0.6981317007977318\n0.349065850,-1.308996939,0.872664626\n", True),
    ],
)
def test_via_points_come_from_any_sensible_table(tmp_path: Path, text: str, radians: bool) -> None:
    table = tmp_path / "via.csv"
    table.write_text(text)
    np.testing.assert_allclose(
        exchange.via_from_csv(table, ARM, radians), [[0, -60, 40], [20, -75, 50]], atol=1e-6
    )


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "0 via points"),
        ("0,-60,40\n", "1 via points"),
        ("0,-60,40\n20,-75\n", "line 2: 2 values"),
        ("0,-60,40\n20,x,50\n", "line 2: 'x' is not a finite number"),
        ("0,-60,40\n20,nan,50\n", "line 2: 'nan'"),
        ("0,-60,inf\n20,-75,50\n", "line 1: 'inf'"),
        ("joint 1,joint 2\n1,2\n", "line 1: the header must name"),
    ],
)
def test_a_table_that_will_not_do_is_refused_with_its_line(tmp_path: Path, text: str, said: str) -> None:
    table = tmp_path / "via.csv"
    table.write_text(text)
    with pytest.raises(InputError, match=said):
        exchange.via_from_csv(table, ARM)


def test_the_commands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    trajectory_file.save(shipped_plan(), "feed.json")
    run = CliRunner(env={"ARMTEMPO_ARM": str(arm_file.default_path())}).invoke
    assert run(main, ["export", "feed.json", "--rate", "2", "-o", "feed.csv"]).exit_code == 0
    assert run(main, ["export", "feed.json", "--format", "ros"]).output.startswith("header:")
    made = run(main, ["import", "feed.csv", "--name", "again"])
    assert made.exit_code == 0, made.output
    assert len(Job.load("again.toml", ARM).via) == len(Path("feed.csv").read_text().splitlines()) - 1
    assert run(main, ["import", "feed.csv", "--name", "again"]).exit_code == 0  # the same content
    Path("again.toml").write_text("# mine")
    again = run(main, ["import", "feed.csv", "--name", "again"])
    assert again.exit_code == 2
    assert "exists" in again.output
    assert Path("again.toml").read_text() == "# mine"
    Path("out.csv").write_text("0,-60,40\n900,0,0\n")
    outside = run(main, ["import", "out.csv"])
    assert outside.exit_code == 2
    assert "out.csv: via_deg[2] = [900, 0, 0]" in outside.output
    assert "range of joint 1" in outside.output
    named = run(main, ["import", "feed.csv", "--name", 'a"b'])
    assert """feed.csv: name = 'a"b' is not allowed""" in named.output
    assert not Path("out.toml").exists()
