"""Torque that a motion needs from each motor, and the motor's available torque at that speed; plans limited
by torque, with the arm's acceleration and jerk limits times one factor."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError, PlanError
from armtempo.basics.progress import Progress, part
from armtempo.kinematics.chain import all_angles_deg
from armtempo.kinematics.dynamics import joint_torques, per_rad
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.parts import DrivenJoint, Limits
from armtempo.model.plan import Plan
from armtempo.splines.trajectory import Trajectory

ENOUGH = 1.5
"""Safety factor: motors are seldom as strong as in their data sheet; a smaller margin gives a warning."""
_STEP_S, _FEWEST, _MOST = 1e-3, 1000, 20_000
"""Sampling interval of a motion, and least and largest number of samples."""
_TRIES = 10
_NEAR = 1.03
"""Ratio of factors at which the search ends: times differ by half as much."""
_LEAST = 1.0 / 16.0
"""Least factor: below it gravity or friction, not acceleration, is the limit."""
_PAYS = 1e-3
"""The search ends if a larger factor saves less than this fraction of the time: speed limits the motion."""


class LeastMargin(NamedTuple):
    """The smallest torque margin of a motion."""

    margin: float
    """Available torque divided by needed torque."""
    joint: str
    time_s: float
    needed_nm: float
    held_nm: float

    @property
    def description(self) -> str:
        """Describe it, without the joint."""
        return (
            f"at {self.time_s:.2f} s its motor needs {self.needed_nm:.3g} Nm and holds {self.held_nm:.3g}, "
            f"{self.margin:.2f} times as much"
        )


@dataclass(frozen=True, eq=False)
class MotorTorques:
    """Torques of a motion at N times."""

    joints: tuple[str, ...]
    times_s: Array
    """(N,)."""
    needed_nm: Array
    """At the motors' shafts, (N, J)."""
    held_nm: Array
    """Available torque, (N, J); NaN if it is not in the arm file."""

    @property
    def margin(self) -> Array:
        """Available torque divided by needed torque: (N, J)."""
        needed = np.abs(self.needed_nm)
        return np.divide(self.held_nm, needed, out=np.full_like(needed, np.inf), where=needed > 0.0)

    @property
    def least(self) -> LeastMargin | None:
        """The smallest margin; None if no motor's torque is known."""
        margin = np.where(np.isnan(self.held_nm), np.inf, self.margin)
        if np.all(np.isnan(self.held_nm)):
            return None
        moment, joint = np.unravel_index(np.argmin(margin), margin.shape)
        figures = (float(each[moment, joint]) for each in (np.abs(self.needed_nm), self.held_nm))
        return LeastMargin(
            float(margin[moment, joint]), self.joints[joint], float(self.times_s[moment]), *figures
        )


def held_nm(joint: DrivenJoint, motor_rad_s: ArrayLike) -> Array:
    """Available torque of a motor at shaft speeds (N,): from its curve, 0 beyond it; else from the virtual
    arm's model.

    In the model it falls to 0.71 of the holding torque at the corner speed. NaN if the arm file has neither.
    """
    speed, model = np.abs(np.asarray(motor_rad_s, dtype=float)), joint.model
    if joint.motor.curve_rpm_nm:
        rpm, torque = np.array(joint.motor.curve_rpm_nm).T
        return np.asarray(np.interp(speed, np.radians(6.0 * rpm), torque, right=0.0))
    corner = model.corner_speed_rad_s or np.inf
    return np.asarray((model.holding_torque_nm or np.nan) / np.hypot(1.0, speed / corner))


def of_motion(arm: Arm, trajectory: Trajectory) -> MotorTorques | None:
    """The torques of a motion, None for an arm without ``dynamics``.

    At the motor: the joint's torque from inverse dynamics and friction (of coupled joints: the sum that does the same
    work), divided by the gear ratio, plus the rotor's inertia. A force along a sliding joint: that of its lead.
    """
    if not any(joint.dynamics for joint in arm.joints):
        return None
    count = int(np.clip(np.ceil(trajectory.duration_s / _STEP_S), _FEWEST, _MOST))
    times = np.linspace(0.0, trajectory.duration_s, count + 1)
    driven, indices = arm.driven, list(arm.driven_indices)
    angles = np.radians(all_angles_deg(arm, trajectory(times)))
    rates, changes = np.zeros_like(angles), np.zeros_like(angles)
    for order, each in enumerate((rates, changes), 1):
        each[:, indices] = np.radians(trajectory(times, order))
    gear = np.array([joint.motor.reduction for joint in driven])
    rotor = np.array([joint.model.rotor_inertia_kg_m2 for joint in driven])
    at_joint = (joint_torques(arm, angles, rates, changes) * per_rad(arm))[:, indices]
    gears = arm.transmission
    needed = gears.motor_loads(at_joint) / gear + rotor * gear * gears.motors_deg(changes[:, indices])
    speeds = gear * gears.motors_deg(rates[:, indices])
    held = np.stack([held_nm(joint, speed) for joint, speed in zip(driven, speeds.T, strict=True)], axis=1)
    return MotorTorques(tuple(joint.name for joint in driven), times, needed, held)


def least_margin(arm: Arm, trajectory: Trajectory) -> LeastMargin | None:
    """The smallest margin of a motion; None if the arm file lacks data."""
    found = of_motion(arm, trajectory)
    return found.least if found else None


def plan_by_torque(arm: Arm, job: Job, progress: Progress | None = None) -> Plan:
    """The fastest plan in which each motor's available torque is ``ENOUGH`` times the needed one at every sample.

    Speed limits are kept; the plan's arm has the scaled limits. Raises InputError for an arm without
    ``dynamics`` or without the torque of a motor, PlanError if slower motions do not help; otherwise as
    ``planner.plan``.
    """
    from armtempo.planning import planner  # here, as it loads all that plans, and a report needs torques only

    held = [held_nm(joint, 0.0) for joint in arm.driven]
    if np.any(np.isnan(held)) or not any(joint.dynamics for joint in arm.joints):
        raise InputError(
            f"arm {arm.name!r}: its motions cannot be planned by torque",
            "give each joint with a motor its dynamics, and each motor its curve_rpm_nm",
        )
    best, short = None, ""
    factor, low, high = 1.0, 0.0, math.inf
    for number in range(_TRIES):
        found = planner.plan(_scaled(arm, factor), job, part(progress, number, _TRIES))
        least = least_margin(*found.loaded_legs[0])
        if least is not None and least.margin < ENOUGH:
            high, short = factor, f"{least.joint}: {least.description}"
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
    """The next factor to try between a feasible ``low`` (0: none yet) and an infeasible ``high`` (infinite:
    none yet)."""
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
