"""The time axis: ends, order of time, refinement, inversion."""

from __future__ import annotations

import numpy as np
import pytest
from armtempo.splines import bspline, time_axis

DEGREES = pytest.mark.parametrize("degree", [3, 5])


@DEGREES
@pytest.mark.parametrize("count", [1, 2, 6, 30])
def test_runs_forward_from_zero_to_the_sum(degree: int, count: int) -> None:
    intervals = 10.0 ** np.random.default_rng(count).uniform(-3, 1, count)
    points = time_axis.control_points(intervals, degree)
    pieces = bspline.polynomials(points, degree)
    assert pieces[0, 0] == pytest.approx(0, abs=1e-12)
    assert pieces[-1].sum() == pytest.approx(intervals.sum(), rel=1e-13)
    slope = np.einsum(
        "gp,mp->mg", np.linspace(0, 1, 50)[:, None] ** np.arange(degree), bspline.derivative(pieces)
    )
    assert np.all(np.diff(points) > 0)
    assert np.all(slope > 0)


def test_mirrors_its_control_points_at_both_ends() -> None:
    points = time_axis.control_points([1.0, 2.0, 4.0], 5)
    assert points.tolist() == [-3.0, -1.0, 0.0, 1.0, 3.0, 7.0, 11.0, 13.0]


@DEGREES
def test_maps_are_the_same_axis(degree: int) -> None:
    intervals = np.array([0.3, 1.0, 0.2, 2.0])
    points = time_axis.control_points(intervals, degree)
    assert intervals @ time_axis.step_map(4, degree) == pytest.approx(points, abs=1e-14)
    assert np.diff(points) @ time_axis.free_map(4, degree) == pytest.approx(points, abs=1e-14)


@DEGREES
@pytest.mark.parametrize("parts", [2, 3, 5])
def test_refined_is_the_same_time_law(degree: int, parts: int) -> None:
    differences = np.random.default_rng(parts).uniform(0.1, 3, 4 + degree - 1)
    coarse = bspline.polynomials(differences @ time_axis.free_map(4, degree), degree)
    finer = time_axis.refined(differences, parts, degree)
    fine = bspline.polynomials(finer @ time_axis.free_map(4 * parts, degree), degree)
    assert np.all(finer > 0)
    assert fine == pytest.approx(bspline.subdivide(coarse, parts), abs=1e-12)


@DEGREES
def test_parameter_inverts_time(degree: int) -> None:
    rng = np.random.default_rng(3)
    for _ in range(20):
        intervals = 10.0 ** rng.uniform(-3, 1, 8)
        pieces = bspline.polynomials(time_axis.control_points(intervals, degree), degree)
        time = rng.uniform(0, intervals.sum(), (5, 40))
        segment, u = time_axis.parameter(pieces, time)
        assert np.all((u >= 0) & (u <= 1))
        assert bspline.evaluate(pieces, segment, u) == pytest.approx(time, abs=1e-13 * intervals.sum())
