"""Recordings thinned to via points: the tolerance holds for the spline that is planned, and rests stay."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from armtempo.basics.errors import InputError
from armtempo.model import exchange, thinning, via_table
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.planning import planner, point_to_point
from armtempo.splines import bspline
from scipy.spatial import cKDTree

from tests.host import problems
from tests.host.made_runs import shipped_plan

ARM = Arm.paper()


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [1.0, 0.1, 0.01])
def test_an_exported_motion_comes_back_thinned_to_the_tolerance(tmp_path: Path, tolerance: float) -> None:
    plan = shipped_plan()
    table = tmp_path / "feed.csv"
    table.write_text(plan.to_csv(60.0))
    found = via_table.read(table, ARM, tolerance_deg=tolerance)
    assert found.lines == 409
    assert found.thinned_to_deg is not None
    assert found.thinned_to_deg <= tolerance
    assert 5 < len(found.via_deg) < {1.0: 15, 0.1: 40, 0.01: 100}[tolerance]
    times = exchange.times_s(plan.trajectory.duration_s, 60.0)
    assert apart_deg(spline_deg(found.via_deg), plan.trajectory(times)) <= found.thinned_to_deg + 1e-3


def spline_deg(via_deg: np.ndarray) -> np.ndarray:
    """Points of the spline that is planned through via points, dense."""
    return bspline.Spline.through(via_deg)(np.linspace(0.0, len(via_deg) - 1.0, 100 * len(via_deg)))


def apart_deg(one: np.ndarray, other: np.ndarray) -> float:
    """Largest distance of a point of either path from the other one, the largest over the joints."""

    def away(points: np.ndarray, path: np.ndarray) -> float:
        parts = max(2, 200_000 // len(path))
        fine = np.linspace(0.0, len(path) - 1.0, parts * len(path))
        dense = np.stack([np.interp(fine, np.arange(len(path)), column) for column in path.T], axis=1)
        return float(cKDTree(dense).query(points, p=np.inf)[0].max())

    return max(away(one, other), away(other, one))


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize(
    "rows",
    [
        [(0, -60, 40), (2, -60, 40), (90, -60, 40), (92, -60, 40), (100, -60, 40)],
        [(0, -60, 40), (2, -60, 40)],
        [(0, -60, 40), (30, -100, 0), (30.5, -99, 0), (0, -60, 40)],
        [(-10, -60, 40), (-10, -150, 60), (190, 10, 100)],
    ],
)
def test_what_is_planned_keeps_the_tolerance(rows: list[tuple[float, float, float]]) -> None:
    """Of uneven via points, which a spline on uneven knots follows and that on even ones does not."""
    points = np.array(rows, dtype=float)
    found = thinning.thinned(points, 0.1, ranges_deg=np.array([joint.range_deg for joint in ARM.driven]))
    job = Job("again", via_deg=found.via_deg.tolist())
    plan = planner.plan(ARM, replace(job, refine=1, starts=1, polish=False, iterations=5))
    moved = plan.trajectory(np.linspace(0.0, plan.trajectory.duration_s, 1500))
    assert apart_deg(moved, points) <= found.off_deg + 0.02 <= 0.12


@pytest.mark.slow
def test_rests_of_a_recording_are_kept_as_stops(tmp_path: Path) -> None:
    """A motion, a second of rest, and a motion back another way, with rests around and noise of an encoder."""
    there = point_to_point.straight("there", (0, -60, 40), (40, -90, 20), ARM)
    back = point_to_point.straight("back", (40, -90, 20), (10, -60, 60), ARM)
    times = np.arange(0.0, 3.0 + there.duration_s + back.duration_s, 0.01)
    angles = np.where(
        times[:, None] < 1.5 + there.duration_s, there(times - 0.5), back(times - 1.5 - there.duration_s)
    )
    rng = np.random.default_rng(7)
    noisy = angles + rng.uniform(-0.004, 0.004, angles.shape)
    table = tmp_path / "recorded.csv"
    rows = "".join(
        f"{time},{','.join(map(str, row))}\n" for time, row in zip(times, noisy.tolist(), strict=True)
    )
    table.write_text(f"time,j1,j2,j3\n{rows}")
    found = via_table.read(table, ARM)
    (rest,) = found.rests_s
    assert found.rests_s[rest] == pytest.approx(1.0, abs=0.15)
    assert "rest at the beginning" in found.notes[0]
    job = Job.from_csv(table, ARM)
    assert [stop.via for stop in job.stops] == [rest]
    plan = planner.plan(ARM, replace(job, refine=1))
    assert problems.faults(plan) == []
    begins_s = plan.trajectory.joints[0].via_times_s[rest]
    during = plan.trajectory(np.linspace(begins_s, begins_s + found.rests_s[rest], 50))
    assert np.ptp(during, axis=0).max() < 1e-6
    moved = plan.trajectory(np.linspace(0.0, plan.trajectory.duration_s, 2000))
    assert apart_deg(moved, noisy) <= 0.1


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
def test_the_bound_of_thinning_holds(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = np.cumsum(rng.normal(size=(12, 3)) * rng.choice([1.0, 20.0], (12, 1)), axis=0)
    found = thinning.thinned(points, 0.5)
    away = apart_deg(spline_deg(found.via_deg), points)
    assert away <= found.off_deg + 0.02, f"seed {seed}"


def test_a_path_without_times_is_thinned_where_asked(tmp_path: Path) -> None:
    table = tmp_path / "arc.csv"
    turn = np.linspace(0.0, np.pi, 600)
    table.write_text(
        "".join(f"{50 + 20 * np.cos(a)},{-60 + 20 * np.sin(a)},40\n" for a in np.repeat(turn, 2))
    )
    assert len(via_table.read(table, ARM).via_deg) == 1200
    found = via_table.read(table, ARM, tolerance_deg=0.1)
    assert 3 < len(found.via_deg) < 25
    np.testing.assert_allclose(found.via_deg[[0, -1]], [[70, -60, 40], [30, -60, 40]], atol=1e-9)


@pytest.mark.parametrize("tolerance", [0.0, -1.0, float("nan"), 91.0])
def test_an_impossible_tolerance_is_refused(tolerance: float) -> None:
    with pytest.raises(InputError, match=r"a tolerance of .* is not allowed"):
        thinning.thinned(np.zeros((3, 2)), tolerance)


@pytest.mark.slow
def test_what_cannot_be_thinned_to_a_motion_is_refused() -> None:
    noise = np.random.default_rng(12).normal(size=(700, 3))
    with pytest.raises(InputError, match=r"more than 513 via points are needed"):
        thinning.thinned(noise, 0.001, np.arange(700.0))
