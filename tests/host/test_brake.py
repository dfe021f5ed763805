"""Brake time: braking by it keeps the limits from anywhere, and a shorter one does not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from armtempo.basics.errors import InputError
from armtempo.model.arm import Arm
from armtempo.model.parts import Limits
from armtempo.model.plan import Plan
from armtempo.planning import brake_time, planner, point_to_point
from armtempo.splines.trajectory import Trajectory

from tests.host import problems

PROBLEMS = {problem.name: problem for problem in problems.load()}


def braked_excess(plan: Plan, brake_s: float, starts: int = 60) -> tuple[float, float]:
    """Largest speed, and acceleration or jerk, over their limits: by differences of the slowed motion."""
    step = brake_s / 4000
    x = np.arange(4001) / 4000
    rate = 1 - (10 * x**3 - 15 * x**4 + 6 * x**5)
    passed = np.concatenate([[0], np.cumsum((rate[1:] + rate[:-1]) / 2)]) * step
    worst = np.zeros(3)
    limits = np.array([joint.limits.values for joint in plan.arm.driven if joint.limits])
    for start in np.linspace(0, plan.trajectory.duration_s - 0.5 * brake_s, starts):
        values = plan.trajectory(start + passed)
        for order in range(3):
            values = np.diff(values, axis=0) / step
            worst[order] = max(worst[order], np.max(np.abs(values) / limits[:, order]))
    return float(worst[0]), float(worst[1:].max())


@pytest.mark.slow
@pytest.mark.parametrize("name", ["feeding", "feeding-shared", "there-and-back"])
def test_braking_keeps_its_limits_and_no_shorter_time_does(name: str) -> None:
    plan = planner.plan(PROBLEMS[name].arm, replace(PROBLEMS[name].job, iterations=100))
    limits = [joint.limits for joint in plan.arm.driven if joint.limits]
    found = brake_time.brake_time_s(plan.trajectory, limits)
    speed, other = braked_excess(plan, min(found, 1.9 * plan.trajectory.duration_s))
    assert speed <= 1 + 1e-6
    assert other <= brake_time.EXCESS * 1.01
    _, shorter = braked_excess(plan, 0.8 * found)
    assert shorter > 1.0
    assert 0.01 < found < 4 * plan.trajectory.duration_s


def changed_excess(
    trajectory: Trajectory, limits: list[Limits], brake_s: float, rate: tuple[float, float]
) -> float:
    """Largest acceleration or jerk over its limit as the rate goes from one to the other, by differences."""
    before, after = rate
    x = np.linspace(0.0, 1.0, 201)
    rates = before + (after - before) * (10 * x**3 - 15 * x**4 + 6 * x**5)
    step = brake_s / 200
    passed = np.concatenate([[0.0], np.cumsum((rates[1:] + rates[:-1]) / 2)]) * step
    times = np.linspace(0.0, trajectory.duration_s, 50, endpoint=False)[:, None] + passed
    values = trajectory(times.ravel()).reshape(*times.shape, -1)
    allowed = np.array([limit.values for limit in limits])
    _, acceleration, jerk = (np.diff(values, order, axis=1) / step**order for order in (1, 2, 3))
    return float(max(np.max(np.abs(acceleration) / allowed[:, 1]), np.max(np.abs(jerk) / allowed[:, 2])))


def test_the_worst_change_of_rate_needs_the_whole_brake_time() -> None:
    """In a motion of 0.7 s, where it matters how far the motion goes on meanwhile."""
    arm = Arm.paper()
    motion = point_to_point.straight("go", [0.0, -60.0, 40.0], [1.0, -60.0, 40.0], arm)
    limits = [joint.limits for joint in arm.driven]
    brake_s = brake_time.brake_time_s(motion, limits)
    worst = max(changed_excess(motion, limits, brake_s, rate) for rate in ((1.0, 0.0), (0.0, 1.0)))
    assert 0.97 * brake_time.EXCESS <= worst <= 1.01 * brake_time.EXCESS


def test_a_motion_beyond_its_limits_has_no_brake_time() -> None:
    arm = Arm.paper()
    motion = point_to_point.straight("go", [0.0, -60.0, 40.0], [40.0, -50.0, 50.0], arm)
    tight = [replace(joint.limits, jerk_deg_s3=joint.limits.jerk_deg_s3 / 2) for joint in arm.driven]
    with pytest.raises(InputError, match="beyond the arm's acceleration or jerk limits"):
        brake_time.brake_time_s(motion, tight)
