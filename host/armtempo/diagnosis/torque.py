"""Torque that the model of the virtual arm asks of each motor, against what the motor has."""

from __future__ import annotations

import math

from armtempo.diagnosis.finding import Finding, error, note, warning
from armtempo.model.arm import Arm
from armtempo.model.parts import DrivenJoint

_ENOUGH = 1.5
"""Motors are seldom as strong as their data sheet: less than half as much again is told."""


def margin(joint: DrivenJoint) -> float | None:
    """Torque of a joint's motor over what gravity and its acceleration limit ask at its speed limit.

    None if the arm file says nothing of the torque; infinite if nothing is asked. Torque falls with speed
    as in the virtual arm: to 0.71 of the holding torque at the corner speed.
    """
    model, motor, limits = joint.model, joint.motor, joint.limits
    if not model.holding_torque_nm:
        return None
    speed = math.radians(limits.speed_deg_s) * motor.gear_ratio
    fallen = math.hypot(1.0, speed / model.corner_speed_rad_s) if model.corner_speed_rad_s else 1.0
    inertia = model.rotor_inertia_kg_m2 + model.inertia_kg_m2 / motor.gear_ratio**2
    asked = inertia * math.radians(limits.acceleration_deg_s2) * motor.gear_ratio + gravity_nm(joint)
    return model.holding_torque_nm / fallen / asked if asked else math.inf


def gravity_nm(joint: DrivenJoint) -> float:
    """Largest torque that gravity asks of the motor within the joint's range."""
    low, high = joint.range_deg
    level = math.ceil(low / 180.0) * 180.0 <= high  # the link comes to level somewhere
    share = 1.0 if level else max(abs(math.cos(math.radians(angle))) for angle in (low, high))
    return abs(joint.model.gravity_torque_nm) * share / joint.motor.gear_ratio


def findings(arm: Arm) -> list[Finding]:
    """Joints whose motor is too weak, or nearly so; and those of which nothing is known."""
    found = [finding for joint in arm.driven for finding in _of(joint)]
    unknown = [joint.name for joint in arm.driven if not joint.model.holding_torque_nm]
    if unknown:
        text = f"not checked for {', '.join(unknown)}: no holding_torque_nm"
        next_step = (
            "give holding_torque_nm, inertia_kg_m2 and gravity_torque_nm in [joint.model] to have it checked"
        )
        found.append(note("torque", text, next_step))
    return found


def _of(joint: DrivenJoint) -> list[Finding]:
    found = margin(joint)
    if found is None or found >= _ENOUGH:
        return []
    holding = joint.model.holding_torque_nm
    if gravity_nm(joint) >= holding:
        text = (
            f"gravity asks {gravity_nm(joint):.2g} Nm of its motor, which holds {holding:g}: the joint falls"
        )
        return [
            error(joint.name, text, "use a larger gear ratio or a stronger motor, or correct [joint.model]")
        ]
    text = f"its motor has {found:.2g} times the torque that gravity and acceleration ask at its limits"
    next_step = "lower acceleration_deg_s2 or speed_deg_s, or correct [joint.model]"
    if found < 1.0:
        return [error(joint.name, f"{text}: it loses steps", next_step)]
    return [warning(joint.name, f"{text}; {_ENOUGH:g} is prudent", next_step)]
