"""Figures of each driven joint: resolution in degrees and mm, speed, torque; findings on coarse steps."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.text import aligned
from armtempo.diagnosis import drives, torque
from armtempo.diagnosis.finding import Finding, warning
from armtempo.kinematics import Geometry, forward
from armtempo.kinematics.chain import all_angles_deg
from armtempo.model.arm import Arm
from armtempo.model.joint_unit import DEG, JointUnit
from armtempo.model.parts import DrivenJoint

COARSE_MM = 0.5
"""Motion of the tool by a step above which there is a finding."""

_POSTURES, _SEED = 500, 1
_STEP_RAD = 1e-5
_HEAD = ("joint", "steps/deg", "deg/step", "tool mm/step", "top steps/s", "motor rpm", "torque")
_WIDTHS = (5, 11, 10, 14, 13, 11, 9)


@dataclass(frozen=True)
class Resolution:
    """One driven joint's smallest step."""

    joint: DrivenJoint
    step_deg: float
    lever_mm: float
    """Largest motion of the tool per radian of this joint within the ranges."""

    @property
    def step_mm(self) -> float:
        """Largest motion of the tool by one step."""
        return float(np.radians(self.step_deg)) * self.lever_mm


def resolutions(arm: Arm) -> tuple[Resolution, ...]:
    """The smallest step of every driven joint."""
    if not arm.driven:
        return ()
    return tuple(
        Resolution(joint, 1.0 / joint.steps_per_deg, float(lever))
        for joint, lever in zip(arm.driven, _levers_mm(arm), strict=True)
    )


def findings(arm: Arm) -> list[Finding]:
    """Joints whose smallest step is more than their following error, or than 0.5 mm at the tool."""
    return [found for resolution in resolutions(arm) for found in _of(resolution)]


def _of(resolution: Resolution) -> list[Finding]:
    joint, found = resolution.joint, []
    limit_deg = joint.encoder.following_error_deg if joint.encoder else 0.0
    key, finer = (
        joint.unit.key("following_error_deg"),
        "a finer screw" if joint.slides else "a larger gear ratio",
    )
    if 0.0 < limit_deg < resolution.step_deg:
        found.append(
            warning(
                joint.name,
                f"its smallest step, {resolution.step_deg:.3g} {joint.unit.name}, is more than its {key} of "
                f"{limit_deg:g}, so the first step may already trip it",
                f"raise {key} above a step, or use more microsteps or {finer}",
            )
        )
    if resolution.step_mm > COARSE_MM:
        found.append(
            warning(
                joint.name,
                f"its smallest step, {resolution.step_deg:.3g} {joint.unit.name}, moves the tool by up to "
                f"{resolution.step_mm:.2g} mm (more than {COARSE_MM:g})",
                f"use more microsteps or {finer}, or accept it: the tool will move in steps of that size",
            )
        )
    return found


def _levers_mm(arm: Arm) -> Array:
    """Largest |d tool / d angle| of each driven joint over postures in the ranges, (J,) in mm/rad; others at home."""
    geometry = Geometry.of(arm)
    postures = _postures_rad(arm)
    levers = np.empty(len(arm.driven))
    for number, joint in enumerate(arm.driven_indices):
        step = _STEP_RAD * np.eye(geometry.joints)[joint]
        moved = forward(geometry, postures + step) - forward(geometry, postures - step)
        levers[number] = np.max(np.linalg.norm(moved[:, :3, 3], axis=1)) / (2 * _STEP_RAD)
    levers[levers < 1e-6] = 0.0
    return levers


def _postures_rad(arm: Arm) -> Array:
    """Postures for the search of the largest lever: driven joints at an end of the range, at home, or random;
    (K, joints)."""
    rng = np.random.default_rng(_SEED)
    low, high = np.array([joint.range_deg for joint in arm.driven]).T
    home = np.array(arm.home_deg)
    anywhere = rng.uniform(low, high, (_POSTURES, len(low)))
    choices = np.stack([np.broadcast_to(row, anywhere.shape) for row in (low, high, home)] + [anywhere])
    picked = np.take_along_axis(choices, rng.integers(0, 4, (1, *anywhere.shape)), axis=0)[0]
    return np.radians(all_angles_deg(arm, np.vstack([home, picked])))


@dataclass(frozen=True)
class JointFigures:
    """Resolution, speed and torque of one driven joint."""

    name: str
    steps_per_deg: float
    step_deg: float
    step_at_tool_mm: float
    """Largest motion of the tool by one step."""
    top_steps_s: float
    """Step rate of its motor at the speed limit, of coupled joints: at the limits of all that the motor moves."""
    motor_rpm: float
    """Motor speed, the same."""
    torque_margin: float | None
    """Torque of the motor divided by the needed torque; None: not known, infinite: none is needed."""
    unit: JointUnit = DEG
    """Of the joint."""

    @property
    def values(self) -> dict[str, Any]:
        """Values for JSON, which has no infinity."""
        margin = None if self.torque_margin is None or math.isinf(self.torque_margin) else self.torque_margin
        found = {self.unit.key(key): value for key, value in asdict(self).items() if key != "unit"}
        return {**found, "torque_margin": margin}


def of(arm: Arm) -> tuple[JointFigures, ...]:
    """The figures of all driven joints."""
    return tuple(
        JointFigures(
            name=joint.name,
            steps_per_deg=1.0 / resolution.step_deg,
            step_deg=resolution.step_deg,
            step_at_tool_mm=resolution.step_mm,
            top_steps_s=drives.top_rate_steps_s(motor),
            motor_rpm=drives.motor_rpm(motor),
            torque_margin=torque.margin(motor),
            unit=joint.unit,
        )
        for resolution, motor in zip(resolutions(arm), arm.motors, strict=True)
        for joint in (resolution.joint,)
    )


def table(joints: Sequence[JointFigures]) -> list[str]:
    """Lines for people; none if nothing is driven."""
    if not joints:
        return []
    head, rows = _HEAD, [_row(joint) for joint in joints]
    if any(joint.unit is not DEG for joint in joints):
        head = ("joint", "steps/unit", "unit/step", *_HEAD[3:])
        rows = [
            (f"{joint.name} ({joint.unit.name})", *row[1:]) for joint, row in zip(joints, rows, strict=True)
        ]
    return aligned([head, *rows], _WIDTHS)


def _row(joint: JointFigures) -> tuple[str, ...]:
    return (
        joint.name,
        f"{joint.steps_per_deg:.5g}",
        f"{joint.step_deg:.4g}",
        f"{joint.step_at_tool_mm:.3g}",
        f"{joint.top_steps_s:.0f}",
        f"{joint.motor_rpm:.4g}",
        "unknown" if joint.torque_margin is None else f"{joint.torque_margin:.3g} x",
    )
