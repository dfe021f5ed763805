"""A joint that a parallelogram turns: its angle is counted from the link before the previous one."""

from __future__ import annotations

import numpy as np
import pytest
from armtempo.kinematics import Geometry, Ranges, forward, numerical
from armtempo.kinematics.shape import refusals
from armtempo.model import shipped

ARM = shipped.load_shipped("community")
GEOMETRY = Geometry.of(ARM)
SEED = 7


def postures(count: int) -> np.ndarray:  # type: ignore[type-arg]
    low, high = Ranges.of(ARM).low, Ranges.of(ARM).high
    return np.random.default_rng(SEED).uniform(low, high, (count, len(low)))


def test_the_forearm_keeps_its_angle_when_the_arm_before_it_turns() -> None:
    still, moved = np.radians([[0.0, 0.0, 100.0, 0.0], [0.0, 30.0, 100.0, 0.0]])
    along = [forward(GEOMETRY, angles)[:3, 3] for angles in (still, moved)]
    elbow = [120 * np.array([np.sin(low), 0.0, np.cos(low)]) for low in (0.0, np.radians(30.0))]
    np.testing.assert_allclose(along[1] - along[0], elbow[1] - elbow[0], atol=1e-9)


def test_the_jacobian_is_that_of_finite_differences() -> None:
    step = 1e-6
    for angles in postures(5):
        target = forward(GEOMETRY, angles)
        by_differences = [
            (
                numerical._miss(GEOMETRY, target, angles + step * unit)
                - numerical._miss(GEOMETRY, target, angles - step * unit)
            )
            / (2 * step)
            for unit in np.eye(4)
        ]
        np.testing.assert_allclose(
            numerical._jacobian(GEOMETRY, angles), np.transpose(by_differences), atol=1e-8
        )


def test_the_numerical_solver_finds_its_postures() -> None:
    ranges = Ranges.of(ARM)
    for angles in postures(10):
        found = numerical.solve(GEOMETRY, forward(GEOMETRY, angles), ranges, np.radians([0, 10, 100, 0]))
        assert found.found
        np.testing.assert_allclose(found.angles_rad, angles, atol=1e-6)


def test_the_closed_form_refuses_it() -> None:
    arm = Geometry.of(shipped.load_shipped("parol6"))
    linked = Geometry(arm.d, arm.a, arm.alpha, arm.offset, (False, False, True, False, False, False))
    assert refusals(arm) == []
    assert refusals(linked) == ["a parallel linkage turns joint 3"]


@pytest.mark.parametrize("shape", [(4,), (3, 4), (2, 5, 4)])
def test_turns_of_any_batch(shape: tuple[int, ...]) -> None:
    angles = np.random.default_rng(SEED).normal(size=shape)
    turns = GEOMETRY.turns(angles)
    np.testing.assert_allclose(turns[..., 2], angles[..., 2] - angles[..., 1])
    np.testing.assert_allclose(turns[..., 3], angles[..., 3] - angles[..., 2])
    np.testing.assert_array_equal(turns[..., :2], angles[..., :2])
