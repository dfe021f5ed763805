"""What planning refuses: wrong input, limits that would be left, sizes that cannot be computed with; and its notes."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from armtempo.basics.errors import InputError, PlanError
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.parts import Limits, LimitSwitches
from armtempo.planning import planner, torque
from armtempo_shared.limits import MAX_STEP_RATE

from tests.host import problems

ARM = Arm.paper()
JOB = Job.paper(ARM)


def with_limits(*limits: float) -> Arm:
    """The shipped arm with other limits in joint 1."""
    first = replace(ARM.joints[0], limits=Limits(*limits))
    return replace(ARM, joints=(first, *ARM.joints[1:]))


@pytest.mark.parametrize(
    ("arm", "changes", "message"),
    [
        (ARM, {"via": ((0.0, -60.0, 40.0),)}, "at least 2 via points with 3 angles"),
        (ARM, {"via": ((0.0, -60.0), (1.0, -60.0))}, "at least 2 via points with 3 angles"),
        (ARM, {"via": ((0.0, -60.0, math.nan), (1.0, -60.0, 40.0))}, "via is .*finite number"),
        (ARM, {"timing": "both"}, "'both'"),
        (ARM, {"refine": 0}, "refine 0"),
        (ARM, {"optimiser": "magic"}, "'magic'"),
        (ARM, {"parameters": {"fitness": "magic"}}, "'magic'"),
        (ARM, {"parameters": {"speed": 1.0}}, "'speed'"),
        (with_limits(-1.0, 50.0, 150.0), {}, "positive numbers"),
        (with_limits(50_000.0, 50.0, 150.0), {}, "1777778 steps/s"),
        (Arm("bare", ARM.joints[3:]), {}, "no joint has a motor"),
    ],
)
def test_refuses_wrong_input(arm: Arm, changes: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        planner.plan(arm, replace(JOB, **changes))


def test_no_plan_goes_beyond_a_switch_within_the_range() -> None:
    arms = [
        replace(ARM, joints=(replace(ARM.joints[0], switches=switches), *ARM.joints[1:]))
        for switches in (LimitSwitches(low=1, low_deg=0.0), LimitSwitches(low="PD0", low_deg=0.0))
    ]
    job = Job("back", via=((20.0, -60.0, 40.0), (-5.0, -60.0, 40.0)), path="through", iterations=5)
    with pytest.raises(PlanError, match="beyond its low switch, which stops it at 0"):
        planner.plan(arms[0], job)
    assert planner.plan(arms[1], job).total_s  # read while homing only
    assert planner.plan(arms[0], replace(job, via=((20.0, -60.0, 40.0), (0.0, -60.0, 40.0)))).total_s


@pytest.mark.slow
def test_no_motor_is_faster_than_its_torque_curve_goes() -> None:
    """Joint 1 at 40 deg/s is 13.3 rpm."""
    first = ARM.joints[0]
    assert first.motor is not None
    motor = replace(first.motor, curve_rpm_nm=((0.0, 0.5), (10.0, 0.4)))
    arm = replace(ARM, joints=(replace(first, motor=motor), *ARM.joints[1:]))
    plan = planner.plan(arm, Job("turn", via=((0.0, -60.0, 40.0), (180.0, -60.0, 40.0))))
    most = 60.0 / motor.gear_ratio
    assert plan.extremes[0].speed_deg_s == pytest.approx(most, rel=1e-3)
    assert torque.held_nm(arm.driven[0], np.radians(plan.extremes[0].speed_deg_s * motor.gear_ratio)) > 0.39
    assert any(f"its curve_rpm_nm ends at 10 rpm: planned with {most:.4g}" in note for note in plan.notes)


@pytest.mark.parametrize(
    ("via", "limits", "bounds_s"),
    [
        ((0.0, 10.0, 30.0), (1e-200, 1e-200, 1e-200), (0.1, 3.0)),
        ((0.0, 10.0, 30.0), (50.0, 50.0, 150.0), (1e300, 1e301)),
        ((0.0, 10.0, 30.0), (50.0, 50.0, 150.0), (1e-200, 1e-199)),
        ((0.0, 1e150, 3e150), (50.0, 50.0, 150.0), (0.1, 3.0)),
    ],
)
def test_refuses_sizes_that_cannot_be_computed_with(
    via: tuple[float, ...], limits: tuple[float, ...], bounds_s: tuple[float, float]
) -> None:
    arm = problems.make_arm([limits], (-1e160, 1e160))
    job = Job("far", tuple((angle,) for angle in via), bounds_s=bounds_s, iterations=5, path="through")
    with pytest.raises(PlanError, match="too different in magnitude"):
        planner.plan(arm, job)


@pytest.mark.slow
def test_refuses_more_steps_than_the_board_makes_together() -> None:
    fast = problems.make_arm([[0.9 * MAX_STEP_RATE / 200 * 360 / 8, 1e9, 1e12]] * 6, microsteps=8)
    via = (tuple([0.0] * 6), tuple([1e6] * 6))
    with pytest.raises(PlanError, match="steps/s"):
        planner.plan(fast, Job("fast", via, iterations=5, path="through"))
