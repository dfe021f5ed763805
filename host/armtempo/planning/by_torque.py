"""Plans as fast as the motors' torque allows: the arm's acceleration and jerk limits times one factor."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from armtempo.basics.errors import InputError, PlanError
from armtempo.basics.progress import Progress, part
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.parts import Limits
from armtempo.model.plan import Plan
from armtempo.planning import planner, torque

_TRIES = 10
_NEAR = 1.03
"""Factors this near to each other are one: times differ by half as much."""
_LEAST = 1.0 / 16.0
"""Of factors: what needs less is held up by gravity or friction, not by acceleration."""
_PAYS = 1e-3
"""A larger factor that saves no more than this part of the time is of no use: speed limits the motion."""


def plan(arm: Arm, job: Job, progress: Progress | None = None) -> Plan:
    """The fastest plan found in which each motor holds ``torque.ENOUGH`` times what it needs, each millisecond.

    Speed limits stay; the plan's arm has the limits that it was planned with. Raises InputError for an arm without
    ``dynamics`` or without the torque of a motor, PlanError where slower motions do not help; else as ``planner.plan``.
    """
    held = [torque.held_nm(joint, 0.0) for joint in arm.driven]
    if np.any(np.isnan(held)) or not any(joint.dynamics for joint in arm.joints):
        raise InputError(
            f"arm {arm.name!r}: its motions cannot be planned by torque",
            "give each joint with a motor its dynamics, and each motor its curve_rpm_nm",
        )
    best, short = None, ""
    factor, low, high = 1.0, 0.0, math.inf
    for number in range(_TRIES):
        found = planner.plan(_scaled(arm, factor), job, part(progress, number, _TRIES))
        least = torque.least_margin(found.holding, found.trajectory)
        if least is not None and least.margin < torque.ENOUGH:
            high, short = factor, f"{least.joint}: {least.words}"
        elif best is not None and found.total_s > best.total_s * (1.0 - _PAYS):
            break
        else:
            best, low = found, factor
        factor = _between(low, high)
        if high < _NEAR * low or factor < _LEAST:
            break
    if best is None:
        raise PlanError(
            f"job {job.name!r}: slower motions do not help: {short}",
            "use a stronger motor or another gear ratio, or correct dynamics and curve_rpm_nm",
        )
    words = f"acceleration and jerk limits are {low:.3g} times the arm file's, as the motors' torque allows"
    return replace(best, notes=(*best.notes, words))


def _between(low: float, high: float) -> float:
    """The next factor to try: the motors hold ``low`` (0: none yet), but not ``high`` (infinite: none yet)."""
    if high == math.inf:
        return 2.0 * low
    return math.sqrt(low * high) if low else 0.5 * high


def _scaled(arm: Arm, factor: float) -> Arm:
    joints = []
    for joint in arm.joints:
        if limits := joint.limits:
            speed, acceleration, jerk = limits.values
            limits = Limits(speed, factor * acceleration, factor * jerk)
        joints.append(replace(joint, limits=limits))
    return replace(arm, joints=tuple(joints))
