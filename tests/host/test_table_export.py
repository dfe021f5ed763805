"""Tables and messages that a motion is exported to."""

from __future__ import annotations

import csv

import numpy as np
import pytest
from armtempo.basics.errors import InputError
from armtempo.model import exchange
from armtempo.model.arm import Arm

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


@pytest.mark.parametrize("rate", [10.0, 333.3, 1e5])
@pytest.mark.parametrize("more_s", [-3e-10, 0.0, 3e-10, 1e-8, 1e-6])
def test_stamps_rise_in_nanoseconds(rate: float, more_s: float) -> None:
    stamps = [round(1e9 * time) for time in exchange.times_s(0.1 + more_s, rate)]
    assert stamps == sorted(set(stamps))
    assert stamps[-1] == round(1e9 * (0.1 + more_s))


def test_exports_give_back_the_same_numbers() -> None:
    plan = shipped_plan()
    times = exchange.times_s(plan.trajectory.duration_s, 10.0)
    rows = list(csv.DictReader(plan.to_csv(10.0).splitlines()))
    assert [float(row["j2_angle_deg"]) for row in rows] == plan.trajectory(times)[:, 1].tolist()
    points = [line for line in plan.to_ros(10.0).splitlines() if line.startswith("- positions: ")]
    found = [[float(each) for each in point[14:-1].split(",")] for point in points]
    assert found == np.radians(plan.trajectory(times)).tolist()


def test_the_start_is_there_at_any_rate() -> None:
    assert exchange.times_s(7.0, 1e-300).tolist() == [0.0, 7.0]


@pytest.mark.parametrize("rate", [0.0, -1.0, float("nan"), 1e9])
def test_an_impossible_rate_is_refused(rate: float) -> None:
    with pytest.raises(InputError, match="not allowed"):
        exchange.times_s(1.0, rate)
