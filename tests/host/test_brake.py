"""Brake times: changes of speed that take them keep the limits from anywhere, and shorter ones do not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.model.arm import Arm
from armtempo.model.parts import Limits
from armtempo.planning import brake_time, planner, point_to_point
from armtempo.splines.trajectory import Trajectory
from armtempo_shared.motion import EVEN_RAMP

from tests import ramps
from tests.host import problems

PROBLEMS = {problem.name: problem for problem in problems.load()}


def changed_excess(
    trajectory: Trajectory,
    limits: list[Limits],
    starts_s: Array,
    lengths_s: Array,
    rate: tuple[float, float],
    shapes: Array,
) -> Array:
    """Largest speed, and acceleration or jerk, over their limits as the rate goes from one to the other: (starts, 2).

    By differences of the stretched motion; after its end it rests, so differences there do not count.
    """
    before, after = rate
    x = np.linspace(0.0, 1.0, 151)
    passed = np.array([ramps.passed(x, before, after, shape) for shape in shapes])
    times = starts_s[:, None] + lengths_s[:, None] * passed
    values = trajectory(times.ravel()).reshape(*times.shape, -1)
    allowed = np.array([limit.values for limit in limits])
    worst = []
    for order in (1, 2, 3):
        values = np.diff(values, axis=1) * 150 / lengths_s[:, None, None]
        inside = times[:, order:, None] < trajectory.duration_s
        worst.append(np.max(np.abs(values) * inside / allowed[:, order - 1], axis=(1, 2)))
    return np.column_stack([worst[0], np.maximum(*worst[1:])])


def every_start(trajectory: Trajectory, count: int = 61) -> Array:
    """Starts that are no multiples of those that were tried."""
    return np.linspace(0.0, trajectory.duration_s, count, endpoint=False)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["feeding", "feeding-shared", "there-and-back"])
def test_every_change_keeps_its_limits_from_anywhere_and_quicker_ones_do_not(name: str) -> None:
    plan = planner.plan(PROBLEMS[name].arm, replace(PROBLEMS[name].job, iterations=100))
    limits = [joint.limits for joint in plan.arm.driven if joint.limits]
    brakes = brake_time.of_motion(plan.trajectory, limits)
    starts = every_start(plan.trajectory)
    for lengths, rates in (
        (brakes.rest_s(starts), ((1.0, 0.0), (0.6, 0.0))),
        (brakes.change_s(starts), ((0.0, 1.0), (0.95, 0.6), (0.1, 0.7))),
    ):
        for rate in rates:
            shapes = np.full(len(starts), EVEN_RAMP) if rate[1] else brakes.rest_shapes(starts)
            found = changed_excess(plan.trajectory, limits, starts, lengths, rate, shapes)
            assert found[:, 0].max() <= 1 + 1e-6
            assert found[:, 1].max() <= brake_time.EXCESS * 1.02, rate
    quicker = changed_excess(
        plan.trajectory, limits, starts, 0.85 * brakes.rest_s(starts), (1.0, 0.0), brakes.rest_shapes(starts)
    )
    assert np.mean(quicker[:, 1] > brake_time.EXCESS) > 0.6


def test_braking_near_an_end_is_quick() -> None:
    """The times follow the motion: at its ends, where it is slow, it takes a part of what the worst takes."""
    arm = Arm.paper()
    motion = point_to_point.straight("go", [0.0, -60.0, 40.0], [40.0, -50.0, 50.0], arm)
    brakes = brake_time.of_motion(motion, [joint.limits for joint in arm.driven])
    late = brakes.rest_s(0.9 * motion.duration_s)
    assert late < 0.3 * brakes.longest_rest_s


def test_the_worst_change_of_rate_needs_the_whole_brake_time() -> None:
    """In a motion of 0.7 s, where it matters how far the motion continues meanwhile."""
    arm = Arm.paper()
    motion = point_to_point.straight("go", [0.0, -60.0, 40.0], [1.0, -60.0, 40.0], arm)
    limits = [joint.limits for joint in arm.driven]
    brakes = brake_time.of_motion(motion, limits)
    starts = every_start(motion, 121)
    worst = max(
        changed_excess(motion, limits, starts, lengths, rate, shapes)[:, 1].max()
        for lengths, rate, shapes in (
            (brakes.rest_s(starts), (1.0, 0.0), brakes.rest_shapes(starts)),
            (brakes.change_s(starts), (0.0, 1.0), np.full(len(starts), EVEN_RAMP)),
        )
    )
    assert 0.97 * brake_time.EXCESS <= worst <= 1.01 * brake_time.EXCESS


def test_a_motion_beyond_its_limits_has_no_brake_times() -> None:
    arm = Arm.paper()
    motion = point_to_point.straight("go", [0.0, -60.0, 40.0], [40.0, -50.0, 50.0], arm)
    tight = [replace(joint.limits, jerk_deg_s3=joint.limits.jerk_deg_s3 / 2) for joint in arm.driven]
    with pytest.raises(InputError, match="beyond the arm's acceleration or jerk limits"):
        brake_time.of_motion(motion, tight)
