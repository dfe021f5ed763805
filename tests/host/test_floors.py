"""Floors: closed forms, no plan beats them, and the path floor against exact cases."""

from __future__ import annotations

import math

import numpy as np
import pytest
from armtempo.model.arm import Limits
from armtempo.planning import lower_bounds, rest_to_rest, topp
from armtempo.splines import bspline

from tests.host.feeding import FEEDING, LIMITS


def test_joint_1_from_rest_to_rest() -> None:
    assert rest_to_rest.floor_s(np.array([0.0, 180.0]), LIMITS[0]) == pytest.approx(
        4.0 + 0.6 + 1 / 3, rel=1e-12
    )


def test_short_way_reaches_neither_speed_nor_acceleration() -> None:
    """Four jerk phases: way 2 J t³, t each."""
    phase = 0.1
    assert rest_to_rest.floor_s(np.array([0.0, 2 * 150 * phase**3]), LIMITS[0]) == pytest.approx(
        4 * phase, rel=1e-9
    )


def test_a_turn_may_keep_its_acceleration() -> None:
    """Between two turns: hold a, swing to -a, hold it."""
    limits = Limits(1e9, 10.0, 20.0)
    both_free = rest_to_rest.floor_s(np.array([0.0, 7.0, 0.0, 7.0]), limits) - rest_to_rest.floor_s(
        np.array([0.0, 7.0, 0.0]), limits
    )
    hold, swing = _between_turns(7.0, limits)
    assert both_free == pytest.approx(2 * hold + swing, rel=1e-6)


def _between_turns(way: float, limits: Limits) -> tuple[float, float]:
    """Time at full acceleration on each side, and of the swing between, by integration."""
    a, swing = limits.acceleration_deg_s2, 2 * limits.acceleration_deg_s2 / limits.jerk_deg_s3
    low, high = 0.0, 10.0
    for _ in range(60):
        hold = (low + high) / 2
        time = np.linspace(0, 2 * hold + swing, 20_001)
        acceleration = np.clip(a - limits.jerk_deg_s3 * (time - hold), -a, a)
        speed = np.concatenate([[0], np.cumsum((acceleration[1:] + acceleration[:-1]) / 2) * time[1]])
        reached = float(np.sum((speed[1:] + speed[:-1]) / 2) * time[1])
        low, high = (hold, high) if reached < way else (low, hold)
    return low, swing


def test_floor_falls_with_every_limit() -> None:
    turns = np.array([-60.0, -110.0, -38.0])
    base = rest_to_rest.floor_s(turns, LIMITS[1])
    for factors in ((2, 1, 1), (1, 2, 1), (1, 1, 2)):
        looser = Limits(*(value * factor for value, factor in zip(LIMITS[1].values, factors, strict=True)))
        assert rest_to_rest.floor_s(turns, looser) < 0.999 * base, factors


def test_turns_of_the_paper_joints() -> None:
    points = bspline.fit(FEEDING, 5)
    assert lower_bounds.turns(points[:, 0], 5) == pytest.approx([0, 180], abs=1e-9)
    assert lower_bounds.turns(points[:, 1], 5) == pytest.approx([-60, -110.32, -38], abs=0.01)
    assert lower_bounds.turns(points[:, 2], 5) == pytest.approx([40, 70.05, -52], abs=0.01)


@pytest.mark.parametrize("joint", range(3))
@pytest.mark.parametrize("degree", [3, 5])
def test_path_floor_of_one_joint_is_the_closed_form(joint: int, degree: int) -> None:
    points = bspline.fit(FEEDING[:, joint], degree)
    speed, acceleration, _ = LIMITS[joint].values
    found = topp.floor_s(points[:, None], degree, np.array([speed]), np.array([acceleration]))
    exact = rest_to_rest.floor_s(lower_bounds.turns(points, degree), Limits(speed, acceleration, 1e12))
    assert found == pytest.approx(exact, abs=3e-3)


def test_path_floor_of_the_paper_motion() -> None:
    """6.78 s on 600 grid points elsewhere; here the limit of finer grids."""
    values = np.array([limit.values for limit in LIMITS])
    assert topp.floor_s(bspline.fit(FEEDING, 5), 5, values[:, 0], values[:, 1]) == pytest.approx(
        6.748, abs=2e-3
    )


def test_straight_path_takes_its_slowest_joint() -> None:
    """All joints in proportion: the path floor is that of the joint with the least room."""
    points = bspline.fit(np.outer([0.0, 1.0, 2.0, 3.0], [30.0, 10.0]), 5)
    both = [Limits(50, 50, 1e9), Limits(10, 5, 1e9)]
    found, kind = lower_bounds.floor(points, 5, both)
    alone = [
        rest_to_rest.floor_s(np.array([0.0, way]), limit)
        for way, limit in zip((90.0, 30.0), both, strict=True)
    ]
    assert found == pytest.approx(max(alone), abs=5e-3)
    assert kind in ("rests", "path")
    assert math.isfinite(found)
