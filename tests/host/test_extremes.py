"""Extremes: bounds that hold and are reached, against dense grids; Bernstein forms; golden section."""

from __future__ import annotations

import numpy as np
import pytest
from armtempo.splines import bernstein, bspline, extremes, time_axis
from armtempo.splines.trajectory import JointSpline

from tests.host.problems import dense


def random_joint(seed: int) -> JointSpline:
    """A joint with any path and a time axis that may change pace by a factor of 100."""
    rng = np.random.default_rng(seed)
    degree, refine, count = int(rng.choice([3, 5])), int(rng.choice([1, 2, 5])), int(rng.integers(1, 9))
    points = bspline.fit(rng.normal(0, 50, count + 1), degree)
    axis = time_axis.control_points(10.0 ** rng.uniform(-1.5, 0.5, count * refine), degree)
    return JointSpline(degree, refine, points, axis)


@pytest.mark.parametrize("seed", range(60))
def test_bounds_hold_and_are_reached(seed: int) -> None:
    joint = random_joint(seed)
    for order, bound in enumerate(extremes.of_joint(joint).values, 1):
        seen = dense(joint, order)
        assert seen <= bound * (1 + 1e-12), f"seed {seed}, order {order}"
        assert seen >= bound * (1 - 2e-3), f"seed {seed}, order {order}"


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(5))
def test_bounds_are_sharp(seed: int) -> None:
    joint = random_joint(seed)
    for order, bound in enumerate(extremes.of_joint(joint).values, 1):
        assert dense(joint, order, 20_001) >= bound * (1 - 1e-6)


def test_joints_together_are_the_joints_alone() -> None:
    joints = [
        JointSpline(
            5,
            1,
            bspline.fit(np.random.default_rng(n).normal(0, 9, 5), 5),
            time_axis.control_points([1, 2, 0.5, n + 1], 5),
        )
        for n in range(3)
    ]
    for joint, found in zip(joints, extremes.of_joints(joints), strict=True):
        assert found.values == pytest.approx(extremes.of_joint(joint).values, rel=1e-10)


def test_range_of_a_path() -> None:
    points = bspline.fit(np.array([[0.0, 5.0], [10.0, 5.0], [10.0, 5.0], [0.0, 5.0]]), 5)
    pieces = np.moveaxis(bspline.polynomials(points, 5), 2, 0)
    low, high = extremes.range_of(pieces)
    seen = np.polynomial.polynomial.polyval(np.linspace(0, 1, 10_001), pieces[0].T)
    assert low == pytest.approx([seen.min(), 5.0], abs=1e-9)
    assert high == pytest.approx([seen.max(), 5.0], abs=1e-6)


def test_bernstein_products_derivatives_and_halves() -> None:
    rng = np.random.default_rng(5)
    a, b = rng.normal(size=(3, 4)), rng.normal(size=(3, 6))
    x = np.linspace(0, 1, 9)

    def value(form: np.ndarray, at: np.ndarray) -> np.ndarray:
        degree = form.shape[-1] - 1
        powers = at[:, None] ** np.arange(degree + 1) * (1 - at[:, None]) ** np.arange(degree, -1, -1)
        return form @ powers.T

    def polynomial(power: np.ndarray, at: np.ndarray) -> np.ndarray:
        return power @ (at[:, None] ** np.arange(power.shape[-1])).T

    fa, fb = bernstein.from_power(a), bernstein.from_power(b)
    assert value(fa, x) == pytest.approx(polynomial(a, x))
    assert value(bernstein.multiply(fa, fb), x) == pytest.approx(polynomial(a, x) * polynomial(b, x))
    assert value(bernstein.elevate(fa, 9), x) == pytest.approx(polynomial(a, x))
    assert value(bernstein.derivative(fb), x) == pytest.approx(polynomial(b[:, 1:] * np.arange(1, 6), x))
    half = bernstein.halves(bernstein.unscale(fb))
    binomials = fb / bernstein.unscale(fb)
    assert value(half[:, 0] * binomials, x) == pytest.approx(polynomial(b, x / 2))
    assert value(half[:, 1] * binomials, x) == pytest.approx(polynomial(b, (1 + x) / 2))
