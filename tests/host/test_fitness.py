"""The fitness of the searches: peaks, scale and times against a fine grid."""

from __future__ import annotations

import numpy as np
import pytest
from armtempo.planning.fitness import Fitness, scale_of
from armtempo.splines import bspline, extremes, time_axis
from armtempo.splines.trajectory import JointSpline

from tests.host.problems import FEEDING, LIMITS


def exact_ratios(points: np.ndarray, intervals: np.ndarray, degree: int) -> np.ndarray:
    """(J, 3)."""
    axis = time_axis.control_points(intervals, degree)
    joints = [JointSpline(degree, 1, column, axis) for column in points.T]
    return np.array([found.values for found in extremes.of_joints(joints)]) / [x.values for x in LIMITS]


@pytest.mark.parametrize("degree", [3, 5])
def test_sees_the_extremes(degree: int) -> None:
    points = bspline.fit(FEEDING, degree)
    fitness = Fitness(points, degree, LIMITS)
    population = np.random.default_rng(2).uniform(0.5, 2.5, (12, 6))
    peaks = fitness.peaks(population).max(axis=2)
    for number, intervals in enumerate(population):
        expected = exact_ratios(points, intervals, degree)
        assert pytest.approx(expected, rel=0.02) == peaks[:, :, number].T


@pytest.mark.parametrize("seed", range(5))
def test_the_scale_is_that_of_the_highest_peaks(seed: int) -> None:
    rng = np.random.default_rng(seed)
    fitness = Fitness(bspline.fit(rng.normal(0, 30, (9, 3)), 5), 5, LIMITS)
    population = rng.uniform(0.1, 3.0, (30, 8))
    assert np.array_equal(fitness.scale(population), scale_of(fitness.peaks(population).max(axis=(1, 2))))


def test_stretched_is_the_time_that_just_keeps_the_limits() -> None:
    points = bspline.fit(FEEDING, 5)
    population = np.random.default_rng(3).uniform(0.5, 2.5, (20, 6))
    found = Fitness(points, 5, LIMITS).stretched(population)
    for value, intervals in zip(found, population, strict=True):
        factor = scale_of(exact_ratios(points, intervals, 5).T).max()
        assert value == pytest.approx(factor * intervals.sum(), rel=0.005)
        assert scale_of(exact_ratios(points, intervals * factor, 5).T).max() == pytest.approx(1, rel=1e-9)


def test_stretched_does_not_depend_on_the_unit_of_time() -> None:
    fitness = Fitness(bspline.fit(FEEDING, 5), 5, LIMITS)
    population = np.random.default_rng(4).uniform(0.5, 2.5, (5, 6))
    assert fitness.stretched(population * 1e-4) == pytest.approx(fitness.stretched(population))


def segment_ratios(intervals_s: np.ndarray) -> np.ndarray:
    """Largest |speed|, |acceleration|, |jerk| over their limits in each segment, (3, J, m), on a fine grid."""
    axis = bspline.polynomials(time_axis.control_points(intervals_s, 5), 5)
    path = bspline.polynomials(bspline.fit(FEEDING, 5), 5)
    u = np.linspace(0.0, 1.0, 2001)
    q = [bspline_at(path, order, u) for order in range(4)]  # (m, U, J)
    t = [bspline_at(axis, order, u)[..., None] for order in range(4)]
    speed = q[1] / t[1]
    acceleration = (q[2] - speed * t[2]) / t[1] ** 2
    jerk = (q[3] - speed * t[3] - 3 * acceleration * t[1] * t[2]) / t[1] ** 3
    limits = np.array([limit.values for limit in LIMITS])
    found = [
        np.abs(each).max(axis=1).T / limits[:, [k]] for k, each in enumerate((speed, acceleration, jerk))
    ]
    return np.array(found)


def bspline_at(pieces: np.ndarray, order: int, u: np.ndarray) -> np.ndarray:
    """(m, U, ...)."""
    derived = bspline.derivative(pieces, order)
    return np.einsum("up,mp...->mu...", u[:, None] ** np.arange(derived.shape[1]), derived)


def test_penalised_is_the_time_where_limits_are_kept_and_more_elsewhere() -> None:
    fitness = Fitness(bspline.fit(FEEDING, 5), 5, LIMITS)
    assert fitness.penalised(np.full((1, 6), 3.0)) == pytest.approx([18.0])
    rng = np.random.default_rng(21)
    for fast in rng.uniform(0.3, 1.5, (5, 6)):
        excess = np.maximum(segment_ratios(fast) - 1.0, 0.0)
        assert (excess > 0).any(), "seed 21"
        assert fitness.penalised(fast[None])[0] == pytest.approx(fast.sum() + 30 * excess.sum(), rel=2e-3), (
            "seed 21"
        )


def test_one_joint_in_a_population_is_the_same_as_alone() -> None:
    fitness = Fitness(bspline.fit(FEEDING, 5), 5, LIMITS)
    population = np.random.default_rng(5).uniform(0.1, 3, (30, 6))
    together = fitness.stretched(population)
    alone = [fitness.stretched(one[None])[0] for one in population]
    assert together == pytest.approx(alone, rel=1e-12)
