"""Fitness of a population: against the exact extremes, one joint or several."""

from __future__ import annotations

import numpy as np
import pytest
from armtempo.planning.fitness import Fitness, stretch_of
from armtempo.splines import bspline, extremes, time_axis
from armtempo.splines.trajectory import JointSpline

from tests.host.feeding import FEEDING, LIMITS


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


def test_stretched_is_the_time_that_just_keeps_the_limits() -> None:
    points = bspline.fit(FEEDING, 5)
    population = np.random.default_rng(3).uniform(0.5, 2.5, (20, 6))
    found = Fitness(points, 5, LIMITS).stretched(population)
    for value, intervals in zip(found, population, strict=True):
        factor = stretch_of(exact_ratios(points, intervals, 5).T).max()
        assert value == pytest.approx(factor * intervals.sum(), rel=0.005)
        assert stretch_of(exact_ratios(points, intervals * factor, 5).T).max() == pytest.approx(1, rel=1e-9)


def test_stretched_does_not_depend_on_the_unit_of_time() -> None:
    fitness = Fitness(bspline.fit(FEEDING, 5), 5, LIMITS)
    population = np.random.default_rng(4).uniform(0.5, 2.5, (5, 6))
    assert fitness.stretched(population * 1e-4) == pytest.approx(fitness.stretched(population))


def test_penalised_is_the_time_where_limits_are_kept_and_more_elsewhere() -> None:
    fitness = Fitness(bspline.fit(FEEDING, 5), 5, LIMITS)
    slow, fast = np.full((1, 6), 3.0), np.full((1, 6), 0.5)
    assert fitness.penalised(slow) == pytest.approx([18.0])
    excess = fitness.peaks(fast) - 1
    assert fitness.penalised(fast)[0] == pytest.approx(3.0 + 30 * excess[excess > 0].sum())


def test_one_joint_in_a_population_is_the_same_as_alone() -> None:
    fitness = Fitness(bspline.fit(FEEDING, 5), 5, LIMITS)
    population = np.random.default_rng(5).uniform(0.1, 3, (30, 6))
    together = fitness.stretched(population)
    alone = [fitness.stretched(one[None])[0] for one in population]
    assert together == pytest.approx(alone, rel=1e-12)
