"""Export and import: what is written says what the plan says, and comes back."""

from __future__ import annotations

import csv
import re
from pathlib import Path

import numpy as np
import pytest
from armtempo.basics import number_table
from armtempo.basics.errors import InputError
from armtempo.cli import main
from armtempo.model import exchange, shipped, via_table
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from click.testing import CliRunner
from scipy.interpolate import CubicSpline

from tests.host.made_runs import shipped_plan

ARM = Arm.paper()


def test_csv_is_the_trajectory_at_any_rate_end_included() -> None:
    plan = shipped_plan()
    rows = list(csv.DictReader(plan.to_csv(37.0).splitlines()))
    assert len(rows[0]) == 1 + 3 * len(exchange.CSV_COLUMNS)
    times = np.array([float(row["time_s"]) for row in rows])
    exact = exchange.times_s(plan.trajectory.duration_s, 37.0)
    np.testing.assert_allclose(times, exact, atol=1e-9)
    assert exact[-1] == plan.trajectory.duration_s
    for order, name in enumerate(exchange.CSV_COLUMNS):
        found = np.array([[float(row[f"j{joint}_{name}"]) for joint in (1, 2, 3)] for row in rows])
        np.testing.assert_allclose(found, plan.trajectory(exact, order), atol=2e-5)


def test_a_plan_has_a_hundred_points_a_second() -> None:
    plan = shipped_plan()
    points = len(exchange.times_s(plan.trajectory.duration_s, 100.0))
    assert plan.to_csv().count("\n") == 1 + points
    assert plan.to_ros().count("time_from_start") == points


def test_ros_points_are_in_radians_and_in_order() -> None:
    plan = shipped_plan()
    text = plan.to_ros(10.0, "base_link")
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
        ("time_s,j1_angle_deg,j2_angle_deg,j3_angle_deg\n8,0,-60,40\n9,20,-75,50\n", False),
        ("0;-60;40\n20;-75;50\n", False),
        ("joint 1;joint 2;joint 3\n0,0;-60,0;40,0\n20,0;-75,0;50,0\n", False),
        ("0\t-60\t40\n20\t-75\t50\n", False),
        ("\ufeffa\tb\tc\r\n0\t-60\t4e1\r\n20\t-75\t50\r\n", False),
        ("0,-1.0471975511965976,0.6981317007977318\n0.349065850,-1.308996939,0.872664626\n", True),
    ],
)
def test_via_points_come_from_any_sensible_table(tmp_path: Path, text: str, radians: bool) -> None:
    table = tmp_path / "via.csv"
    table.write_text(text, encoding="utf-8")
    np.testing.assert_allclose(
        via_table.via_points(number_table.read(table), ARM, radians).via_deg,
        [[0, -60, 40], [20, -75, 50]],
        atol=1e-6,
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
        ("joint 1,joint 2\n1,2\n", "line 1: the header does not name"),
        ("joint 1;joint 2;joint 3\n0;-60;40\n1;2\n", "line 3: 2 values"),
        ("time_s,joint 1,joint 2,joint 3\n1,0,-60,40\n1,20,-75,50\n", "line 3: time_s does not increase"),
        ("header:\n  stamp: {sec: 0, nanosec: 0}\n", "is a ROS message, not a table; export"),
    ],
)
def test_a_table_that_will_not_do_is_refused_with_its_line(tmp_path: Path, text: str, said: str) -> None:
    table = tmp_path / "via.csv"
    table.write_text(text)
    with pytest.raises(InputError, match=said):
        via_table.via_points(number_table.read(table), ARM)


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [1.0, 0.1, 0.01])
def test_an_exported_motion_comes_back_thinned_to_the_tolerance(tmp_path: Path, tolerance: float) -> None:
    plan = shipped_plan()
    table = tmp_path / "feed.csv"
    table.write_text(plan.to_csv(60.0))
    found = via_table.via_points(number_table.read(table), ARM, tolerance_deg=tolerance)
    assert found.lines == 409
    assert 5 < len(found.via_deg) < {1.0: 15, 0.1: 25, 0.01: 50}[tolerance]
    times = exchange.times_s(plan.trajectory.duration_s, 60.0)
    angles = plan.trajectory(times)
    kept = [int(np.abs(angles - via).max(axis=1).argmin()) for via in found.via_deg]
    assert kept[0] == 0
    assert kept[-1] == len(times) - 1
    assert kept == sorted(kept)
    spline = CubicSpline(times[kept], found.via_deg, bc_type="clamped")
    assert np.abs(spline(times) - angles).max() <= tolerance + 1e-6


def test_a_path_without_times_is_thinned_where_asked(tmp_path: Path) -> None:
    table = tmp_path / "arc.csv"
    turn = np.linspace(0.0, np.pi, 600)
    table.write_text("".join(f"{20 * np.cos(a)},{-60 + 20 * np.sin(a)},40\n" for a in np.repeat(turn, 2)))
    assert len(via_table.via_points(number_table.read(table), ARM).via_deg) == 1200
    found = via_table.via_points(number_table.read(table), ARM, tolerance_deg=0.1)
    assert 3 < len(found.via_deg) < 25
    np.testing.assert_allclose(found.via_deg[[0, -1]], [[20, -60, 40], [-20, -60, 40]], atol=1e-9)


@pytest.mark.parametrize("tolerance", [0.0, -1.0, float("nan"), 91.0])
def test_an_impossible_tolerance_is_refused(tolerance: float) -> None:
    with pytest.raises(InputError, match=r"a tolerance of .* is not allowed"):
        via_table.thinned(np.zeros((3, 2)), tolerance)


def test_what_cannot_be_thinned_to_a_motion_is_refused() -> None:
    noise = np.random.default_rng(12).normal(size=(700, 3))
    with pytest.raises(InputError, match=r"more than 513 via points are needed"):
        via_table.thinned(noise, 0.001, np.arange(700.0))


def test_the_commands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    shipped_plan().save("feed.json")
    run = CliRunner(env={"ARMTEMPO_ARM": str(shipped.arm_path())}).invoke
    assert run(main, ["export", "feed.json", "--rate", "2", "-o", "feed.csv"]).exit_code == 0
    assert run(main, ["export", "feed.json", "--format", "ros"]).output.startswith("header:")
    made = run(main, ["import", "feed.csv", "--name", "again"])
    assert made.exit_code == 0, made.output
    assert re.match(
        r"15 lines reduced to \d+ via points: .* within 0.1 deg; 'armtempo plan' computes new times\n",
        made.output,
    )
    assert Job.load("again.toml", ARM).timing == "shared"
    assert run(main, ["import", "feed.csv", "--name", "again"]).exit_code == 0  # the same content
    Path("again.toml").write_text("# mine")
    again = run(main, ["import", "feed.csv", "--name", "again"])
    assert again.exit_code == 2
    assert "exists" in again.output
    assert Path("again.toml").read_text() == "# mine"
    Path("out.csv").write_text("0,-60,40\n900,0,0\n")
    outside = run(main, ["import", "out.csv"])
    assert outside.exit_code == 2
    assert "out.csv: via_deg P1 = [900, 0, 0]" in outside.output
    assert "range of joint 1" in outside.output
    named = run(main, ["import", "feed.csv", "--name", 'a"b'])
    assert """feed.csv: name = 'a"b' is not allowed""" in named.output
    assert not Path("out.toml").exists()
