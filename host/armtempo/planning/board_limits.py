"""What the board can hold and how fast it can step: checks of arm and trajectory against it."""

from __future__ import annotations

from bisect import bisect_right

import numpy as np
from armtempo_shared import motion
from armtempo_shared.limits import (
    LONGEST_SPAN_TICKS,
    LONGEST_TICKS,
    MAX_BACKLASH_STEPS,
    MAX_CROSSING_RATE,
    MAX_MOTION_BYTES,
    MAX_SEGMENTS,
    MAX_STEP_RATE,
    MAX_STEP_RATE_SUM,
    MOST_SPAN_STEPS,
    MOST_STEPS,
    TICK_HZ,
)

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError, PlanError
from armtempo.model.arm import Arm
from armtempo.model.drive_limits import Crossing
from armtempo.model.parts import DrivenJoint
from armtempo.splines.extremes import Extremes
from armtempo.splines.trajectory import JointSpline, Trajectory

ESTIMATED = "(estimated; 'armtempo selftest' measures your board)"

LONGEST_CROSSING_S = 2.0
"""Of backlash: real gears take tenths of a second; the board's record can hold twice as long."""

COUPLED_AXES = "the arm has coupled joints, whose motors need one time axis for all joints"
SHARE = 'take timing = "shared" (--timing shared)'


def highest_rates(arm: Arm) -> list[float]:
    """The step rate of each motor at its speed limit, steps/s, while it crosses its backlash.

    Raises InputError if the board cannot step that fast.
    """
    found = []
    for motor, crossing in zip(arm.motors, arm.crossings, strict=True):
        speed_deg_s = motor.limits.speed_deg_s + (crossing.speed_deg_s if crossing else 0.0)
        rate = speed_deg_s * motor.steps_per_deg
        if rate > MAX_STEP_RATE:
            raise InputError(
                f"arm {arm.name!r}: {motor.name} at its speed limit of {speed_deg_s:g} {motor.unit.name}/s needs "
                f"{rate:.0f} steps/s; the board supports at most {MAX_STEP_RATE} {ESTIMATED}",
                "check the unit, lower the limit, or use fewer microsteps",
            )
        found.append(rate)
    return found


def check_crossings(arm: Arm) -> None:
    """Raise InputError if the board cannot cross a motor's backlash while its joint moves."""
    for motor, crossing in zip(arm.motors, arm.crossings, strict=True):
        if crossing:
            _check_crossing(arm, motor, crossing)


def _check_crossing(arm: Arm, motor: DrivenJoint, crossing: Crossing) -> None:
    what = f"arm {arm.name!r}: {motor.name}: {motor.unit.key('backlash_deg')} = {crossing.play_deg:g}"
    if crossing.duration_s > LONGEST_CROSSING_S:
        raise InputError(
            f"{what}: to cross it takes {crossing.duration_s:.2g} s at its limits, more than {LONGEST_CROSSING_S:g} s",
            "check the unit, and the joint's limits",
        )
    steps = crossing.play_deg * motor.steps_per_deg
    gained_deg_s = motor.limits.acceleration_deg_s2 * crossing.duration_s
    rate = (min(motor.limits.speed_deg_s, gained_deg_s) + crossing.speed_deg_s) * motor.steps_per_deg
    if rate > MAX_CROSSING_RATE or steps > MAX_BACKLASH_STEPS:
        raise InputError(
            f"{what} is {steps:.0f} steps, and until they are made the motor reaches {rate:.0f} steps/s; the board "
            f"makes at most {MAX_BACKLASH_STEPS} and {MAX_CROSSING_RATE} steps/s",
            f"use fewer microsteps, or lower {motor.unit.key('acceleration_deg_s2')}",
        )


def most_segments(arm: Arm, shared: bool = True) -> int:
    """The most segments of quintic splines, with one of time for each of a path, that the board's record can hold."""
    sizes = [motion.size(5, len(arm.driven), shared, count, 1) for count in range(1, MAX_SEGMENTS + 1)]
    return bisect_right(sizes, MAX_MOTION_BYTES)


def step_rates(arm: Arm, reached: tuple[Extremes, ...]) -> float:
    """Sum of the highest step rates of all motors, steps/s; of coupled joints, as if they were fastest together, and
    with the crossing of backlash."""
    speeds: list[float] = arm.transmission.largest_motors_deg([most.speed_deg_s for most in reached]).tolist()
    extra = [crossing.speed_deg_s if crossing else 0.0 for crossing in arm.crossings]
    return sum(
        (speed + more) * joint.motor.steps_per_deg
        for speed, more, joint in zip(speeds, extra, arm.driven, strict=True)
    )


def format_rate(rates: float) -> str:
    """Text: a sum of step rates compared with the board's."""
    return f"the joints together need up to {rates:.0f} steps/s; the board supports {MAX_STEP_RATE_SUM} {ESTIMATED}"


def check_held(trajectory: Trajectory, arm: Arm) -> None:
    """Raise PlanError if a control point exceeds the range of the board's integers."""
    all_steps = motor_points_steps(trajectory, arm)
    for number, (joint_spline, joint, steps) in enumerate(
        zip(trajectory.joints, arm.driven, all_steps, strict=True)
    ):
        where = f"trajectory {trajectory.name!r}, {joint.name}"
        if not (number and trajectory.shared):
            _check_times(where, joint_spline)
        stands = bool(np.all(steps == steps[0]))
        if np.max(np.abs(steps)) >= MOST_STEPS or (
            not stands and _span(steps, joint_spline.degree) >= MOST_SPAN_STEPS
        ):
            raise PlanError(f"{where}: more steps than the board can count", "use fewer microsteps")


def motor_points_steps(trajectory: Trajectory, arm: Arm) -> list[Array]:
    """The control points of each motor's spline in steps, (n + degree,); exact, as they are linear in the joints'.

    Raises InputError for coupled joints whose time axes differ.
    """
    points = [joint.angle_points_deg for joint in trajectory.joints]
    if arm.coupling:
        if not trajectory.shared:
            raise InputError(f"trajectory {trajectory.name!r}: {COUPLED_AXES}", SHARE)
        points = [*arm.transmission.motors_deg(np.stack(points, axis=-1)).T]
    return [of_motor * joint.motor.steps_per_deg for of_motor, joint in zip(points, arm.driven, strict=True)]


def _check_times(where: str, joint_spline: JointSpline) -> None:
    ticks = joint_spline.time_points_s * TICK_HZ
    if np.max(np.abs(ticks)) >= LONGEST_TICKS:
        longest_s, reached_s = LONGEST_TICKS / TICK_HZ, ticks.max() / TICK_HZ
        raise PlanError(
            f"{where}: lasts {joint_spline.duration_s:.0f} s, its time control points reach {reached_s:.0f} s, "
            f"the board counts to {longest_s:.0f} s",
            "mark via points with stop = true and plan with --split, or raise refine",
        )
    span = _span(ticks, joint_spline.degree)
    if span >= LONGEST_SPAN_TICKS:
        raise PlanError(
            f"{where}: its time segments are so long that {joint_spline.degree} of them span "
            f"{span / TICK_HZ:.0f} s, the board holds {LONGEST_SPAN_TICKS / TICK_HZ:.0f} s",
            "raise refine or add via points",
        )


def _span(points: Array, degree: int) -> float:
    """Largest distance among the degree + 1 control points of one segment."""
    segments = np.lib.stride_tricks.sliding_window_view(points, degree + 1)
    return float(np.max(np.ptp(segments, axis=1)))
