"""Splines, the time axis, trajectories, and bounds of their extremes, against dense grids."""

from __future__ import annotations

import numpy as np
import pytest
from armtempo.basics.errors import InputError
from armtempo.splines import bernstein, bspline, extremes, time_axis
from armtempo.splines.trajectory import JointSpline, Trajectory
from numpy.typing import NDArray

from tests.host.problems import FEEDING, dense

DEGREES = pytest.mark.parametrize("degree", [3, 5])
TABLE_6 = (1.514, 0.498, 1.638, 0.713, 0.257, 1.413)


@pytest.mark.parametrize("degree", [3, 5])
@pytest.mark.parametrize("count", [2, 3, 4, 7, 60])
def test_passes_its_points_and_starts_and_ends_at_rest(degree: int, count: int) -> None:
    points = np.random.default_rng(count).normal(0, 100, (count, 2))
    pieces = bspline.polynomials(bspline.fit(points, degree), degree)
    assert pieces.shape == (count - 1, degree + 1, 2)
    assert pieces[:, 0] == pytest.approx(points[:-1], abs=1e-11)
    assert pieces[-1].sum(axis=0) == pytest.approx(points[-1], abs=1e-11)
    for order in range(1, (degree + 1) // 2):
        derived = bspline.derivative(pieces, order)
        assert derived[0, 0] == pytest.approx(0, abs=1e-10)
        assert derived[-1].sum(axis=0) == pytest.approx(0, abs=1e-10)


@pytest.mark.parametrize("degree", [3, 5])
def test_is_smooth_at_the_points(degree: int) -> None:
    pieces = bspline.polynomials(bspline.fit(FEEDING, degree), degree)
    for order in range(degree):
        derived = bspline.derivative(pieces, order)
        assert derived[1:, 0] == pytest.approx(derived[:-1].sum(axis=1), abs=1e-9)


def test_one_joint_alone_is_the_same_as_among_others() -> None:
    together = bspline.fit(FEEDING, 5)
    assert bspline.fit(FEEDING[:, 1], 5) == pytest.approx(together[:, 1], abs=1e-12)


@pytest.mark.parametrize("degree", [3, 5])
@pytest.mark.parametrize("parts", [1, 2, 3, 8])
def test_subdivided_is_the_same_curve(degree: int, parts: int) -> None:
    pieces = bspline.polynomials(bspline.fit(FEEDING, degree), degree)
    finer = bspline.subdivide(pieces, parts)
    v = np.linspace(0, 1, 7)
    for segment in range(len(finer)):
        u = (segment % parts + v) / parts
        expected = np.polynomial.polynomial.polyval(u, pieces[segment // parts])
        assert np.polynomial.polynomial.polyval(v, finer[segment]) == pytest.approx(expected, abs=1e-10)


@pytest.mark.parametrize("points", [[1.0], [], [1.0, np.nan], [1.0, np.inf]])
def test_refuses_what_is_no_path(points: list[float]) -> None:
    with pytest.raises(InputError, match="two points"):
        bspline.fit(points, 5)


def test_refuses_other_degrees() -> None:
    with pytest.raises(InputError, match="degree 4"):
        bspline.fit([0.0, 1.0], 4)


# the time axis: ends, order of time, refinement, inversion


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


def free_map(count: int, degree: int) -> NDArray[np.float64]:
    """The linear map from differences of control points to control points, with t = 0 at the start and free ends."""
    differences = count + degree - 1
    points = np.zeros((differences, count + degree))
    points[:, 1:] = np.cumsum(np.eye(differences), axis=1)
    return np.asarray(points - (points[:, : degree + 1] @ bspline.basis(degree)[0])[:, None])


@DEGREES
def test_maps_are_the_same_axis(degree: int) -> None:
    intervals = np.array([0.3, 1.0, 0.2, 2.0])
    points = time_axis.control_points(intervals, degree)
    assert intervals @ time_axis.step_map(4, degree) == pytest.approx(points, abs=1e-14)
    assert np.diff(points) @ free_map(4, degree) == pytest.approx(points, abs=1e-14)


@DEGREES
@pytest.mark.parametrize("parts", [2, 3, 5])
def test_refined_is_the_same_time_law(degree: int, parts: int) -> None:
    differences = np.random.default_rng(parts).uniform(0.1, 3, 4 + degree - 1)
    coarse = bspline.polynomials(differences @ free_map(4, degree), degree)
    finer = time_axis.refined(differences, parts, degree)
    fine = bspline.polynomials(finer @ free_map(4 * parts, degree), degree)
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


@DEGREES
def test_parameter_takes_few_steps(degree: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """At knots, ends and beyond them too, where a bracket that is only halved would take 50."""
    evaluated, evaluate = [0], bspline.evaluate

    def counted(*arguments: np.ndarray) -> np.ndarray:
        evaluated[0] += 1
        return evaluate(*arguments)

    monkeypatch.setattr(bspline, "evaluate", counted)
    rng = np.random.default_rng(4)
    for _ in range(20):
        intervals = 10.0 ** rng.uniform(-1, 1, 8)
        pieces = bspline.polynomials(time_axis.control_points(intervals, degree), degree)
        whole = pieces[-1].sum()
        knots = np.append(pieces[:, 0], whole)
        evaluated[0] = 0
        segment, u = time_axis.parameter(pieces, np.concatenate([[-1.0, whole + 1.0], knots]))
        assert evaluated[0] <= 2
        assert set(u) == {0.0, 1.0}
        assert list(segment) == [0, 7, *range(8), 7]
        time_axis.parameter(pieces, np.linspace(0.0, whole, 1000))
        assert evaluated[0] <= 40


# trajectories: Eqs. (17) to (19) against differences, ends, rest, and the paper's printed figures


def made(via: np.ndarray, intervals: object, degree: int = 5) -> JointSpline:
    """The spline of one joint."""
    axis = time_axis.control_points(np.asarray(intervals, dtype=float), degree)
    return JointSpline(degree, 1, bspline.fit(via, degree), axis)


@pytest.mark.parametrize("degree", [3, 5])
def test_each_order_is_the_derivative_of_the_one_before(degree: int) -> None:
    joint = made(FEEDING[:, 1], TABLE_6, degree)
    time = np.linspace(0.01, joint.duration_s - 0.01, 997)
    step = 1e-5
    for order in range(3):
        rise = (joint(time + step, order) - joint(time - step, order)) / (2 * step)
        scale = np.abs(joint(time, order + 1)).max()
        near_knot = np.min(np.abs(time[:, None] - joint.via_times_s), axis=1) < 2 * step
        assert rise[~near_knot] == pytest.approx(joint(time, order + 1)[~near_knot], abs=1e-6 * scale)


def test_passes_the_via_points_and_rests_at_the_ends() -> None:
    joint = made(FEEDING[:, 2], TABLE_6)
    assert joint.duration_s == pytest.approx(6.033, abs=1e-12)
    assert joint(joint.via_times_s) == pytest.approx(FEEDING[:, 2], abs=1e-9)
    for order in (1, 2):
        assert joint([0.0, joint.duration_s], order) == pytest.approx([0, 0], abs=1e-9)


def test_rests_outside_its_time() -> None:
    joint = made(FEEDING[:, 0], TABLE_6, 3)
    outside = np.array([-5.0, -1e-9, joint.duration_s + 1e-9, 99.0])
    assert joint(outside) == pytest.approx([0, 0, 180, 180], abs=1e-9)
    for order in (1, 2, 3):
        assert not joint(outside, order).any()


def test_keeps_the_shape_of_the_times() -> None:
    joint = made(FEEDING[:, 0], TABLE_6)
    trajectory = Trajectory("two", (joint, made(FEEDING[:, 1], np.full(6, 2.0))), False)
    assert joint(1.0).shape == ()
    assert joint(np.zeros((2, 3)), 2).shape == (2, 3)
    assert trajectory(np.zeros((2, 3)), 1).shape == (2, 3, 2)
    assert trajectory.duration_s == pytest.approx(12)
    assert trajectory(12.0) == pytest.approx([180, -38], abs=1e-9)


@pytest.mark.parametrize(
    ("degree", "intervals", "figures"),
    [
        (5, [2.0] * 6, (29.1186, 15.7580, 54.773)),
        (3, [2.0] * 6, (27.596, 19.3077, None)),
        (5, TABLE_6, (49.99, 47.33, 150.06)),
    ],
)
def test_figures_of_joint_1(degree: int, intervals: list[float], figures: tuple[float | None, ...]) -> None:
    """Section 2.3 (29.12 and 15.76) and Tables 5 and 6 of the paper."""
    joint = made(FEEDING[:, 0], intervals, degree)
    time = np.linspace(0, joint.duration_s, 20_001)
    for order, figure in enumerate(figures, 1):
        if figure is not None:
            assert np.abs(joint(time, order)).max() == pytest.approx(figure, rel=1.5e-4)


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
