"""The numerical inverse: for arms that the closed form does not serve."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from armtempo.kinematics import Geometry, Ranges, forward, inverse, refusals
from armtempo.kinematics.numerical import solve
from armtempo.model.arm import Arm

from tests.host.published_arms import PAPER

RANGES = Ranges.of(Arm.paper())
OFFSET_WRIST = replace(PAPER, a=(*PAPER.a[:3], 15.0, 0.0, 0.0))


@pytest.mark.parametrize("seed", range(8))
def test_an_arm_with_an_offset_wrist_is_served(seed: int) -> None:
    assert refusals(OFFSET_WRIST)
    rng = np.random.default_rng(seed)
    angles = rng.uniform(RANGES.low * 0.8, RANGES.high * 0.8)
    pose = forward(OFFSET_WRIST, angles)
    found = solve(OFFSET_WRIST, pose, RANGES, angles + rng.uniform(-0.3, 0.3, 6))
    assert found.found, found.reason
    assert found.reason == ""
    assert (found.angles_rad >= RANGES.low).all()
    assert (found.angles_rad <= RANGES.high).all()
    difference = forward(OFFSET_WRIST, found.angles_rad) - pose
    assert np.abs(difference[:3, :3]).max() < 1e-9
    assert np.abs(difference[:3, 3]).max() < 1e-9 * OFFSET_WRIST.reach


def test_agrees_with_the_closed_form() -> None:
    angles = np.radians([30.0, -70.0, 20.0, 40.0, 50.0, 60.0])
    pose = forward(PAPER, angles)
    found = solve(PAPER, pose, RANGES, angles + 0.1)
    apart = np.abs(inverse(PAPER, pose).angles_rad[0] - found.angles_rad).max(axis=1)
    assert apart.min() < 1e-7


def test_a_pose_out_of_reach_says_how_far_the_best_posture_stays_away() -> None:
    pose = np.eye(4)
    pose[:3, 3] = 2000.0, 0.0, 130.0
    found = solve(OFFSET_WRIST, pose, RANGES, np.zeros(6))
    assert not found.found
    assert "no posture found from 20 starts" in found.reason
    assert found.position_error > 1000.0


def test_the_same_seed_gives_the_same_answer() -> None:
    pose = forward(OFFSET_WRIST, np.radians([150.0, -20.0, -100.0, 90.0, -80.0, 200.0]))
    first, second = (solve(OFFSET_WRIST, pose, RANGES, np.zeros(6), seed=3) for _ in range(2))
    np.testing.assert_array_equal(first.angles_rad, second.angles_rad)


def test_an_arm_without_any_length_only_turns() -> None:
    point = Geometry((5.0,), (0.0,), (0.0,), (0.0,))
    ranges = Ranges(np.full(1, -np.pi), np.full(1, np.pi))
    assert solve(point, forward(point, [0.5]), ranges, np.zeros(1)).angles_rad == pytest.approx([0.5])
    away = solve(point, np.eye(4), ranges, np.zeros(1))
    assert (away.found, away.position_error) == (False, 5.0)


def test_arms_with_fewer_joints_than_the_pose_needs() -> None:
    planar = Geometry((0.0, 0.0), (3.0, 4.0), (0.0, 0.0), (0.0, 0.0))
    ranges = Ranges(np.full(2, -np.pi), np.full(2, np.pi))
    found = solve(planar, forward(planar, [0.5, 0.7]), ranges, np.zeros(2))
    assert found.found
    np.testing.assert_allclose(found.angles_rad, [0.5, 0.7], atol=1e-8)
