"""Brake time: braking by it keeps the limits from anywhere, and a shorter one does not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from armtempo.errors import InputError
from armtempo.model.arm import Arm
from armtempo.model.plan import Plan
from armtempo.planning import brake_time, planner, point_to_point

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


def test_a_motion_beyond_its_limits_has_no_brake_time() -> None:
    arm = Arm.paper()
    motion = point_to_point.straight("go", [0.0, -60.0, 40.0], [40.0, -50.0, 50.0], arm)
    tight = [replace(joint.limits, jerk_deg_s3=joint.limits.jerk_deg_s3 / 2) for joint in arm.driven]
    with pytest.raises(InputError, match="beyond the arm's acceleration or jerk limits"):
        brake_time.brake_time_s(motion, tight)
