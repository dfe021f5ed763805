"""Trajectories: Eqs. (17) to (19) against differences, ends, rest, and the paper's printed figures."""

from __future__ import annotations

import numpy as np
import pytest
from armtempo.splines import bspline, time_axis
from armtempo.splines.trajectory import JointSpline, Trajectory

from tests.host.feeding import FEEDING

TABLE_6 = (1.514, 0.498, 1.638, 0.713, 0.257, 1.413)


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
