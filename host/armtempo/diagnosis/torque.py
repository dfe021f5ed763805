"""Checks of each motor's torque at its limits, by the model in the arm file, and of masses."""

from __future__ import annotations

import math

import numpy as np

from armtempo.diagnosis.finding import Finding, error, note, warning
from armtempo.kinematics.dynamics import inertia_matrix
from armtempo.model.arm import Arm
from armtempo.model.parts import DrivenJoint, Dynamics, Joint
from armtempo.planning.torque import ENOUGH, held_nm

_TRIANGLE = 1e-6
"""Relative rounding allowed in the triangle inequality of the moments of inertia."""
_HEAVY_KG = 50.0
"""Above the mass of any link of a stepper arm."""


def margin(joint: DrivenJoint) -> float | None:
    """Torque of a motor at its speed limit, divided by that needed for gravity and its acceleration limit.

    By ``joint.model``; None if the torque is not known; infinite if none is needed.
    """
    model, motor, limits = joint.model, joint.motor, joint.limits
    held = float(held_nm(joint, math.radians(limits.speed_deg_s) * motor.reduction))
    if math.isnan(held):
        return None
    inertia = model.rotor_inertia_kg_m2 + joint.moved_kg_m2 / motor.reduction**2
    asked = inertia * math.radians(limits.acceleration_deg_s2) * motor.reduction + gravity_nm(joint)
    return held / asked if asked else math.inf


def gravity_nm(joint: DrivenJoint) -> float:
    """Largest gravity torque at the motor within the joint's range, Nm."""
    low, high = joint.range_deg
    if joint.slides:
        return abs(joint.weight_nm) / joint.motor.reduction
    level = math.ceil(low / 180.0) * 180.0 <= high  # the link is horizontal somewhere in the range
    share = 1.0 if level else max(abs(math.cos(math.radians(angle))) for angle in (low, high))
    return abs(joint.weight_nm) * share / joint.motor.reduction


def findings(arm: Arm) -> list[Finding]:
    """Findings about weak motors, unknown torques, and implausible dynamics."""
    found = [finding for joint in arm.motors for finding in _of(joint)]
    unknown = [joint.name for joint in arm.driven if np.isnan(held_nm(joint, 0.0))]
    if unknown:
        next_step = (
            "give curve_rpm_nm in [joint.motor], and masses in [joint.dynamics], to have plans checked"
        )
        found.append(
            note("torque", f"not checked for {', '.join(unknown)}: no torque of the motor", next_step)
        )
    for joint in arm.joints:
        if joint.dynamics is not None:
            found += _body(joint, joint.dynamics)
    return found


def _body(joint: Joint, body: Dynamics) -> list[Finding]:
    """Findings about the masses of a row."""
    least, middle, most = np.linalg.eigvalsh(inertia_matrix(body.inertia_kg_m2))
    found = []
    if least < -_TRIANGLE * most or most > (least + middle) * (1.0 + _TRIANGLE):
        text = f"no body has the inertia {list(body.inertia_kg_m2)}"
        found.append(
            error(joint.name, text, "give xx, yy, zz, xy, xz, yz about the centre of mass, in kg m^2")
        )
    elif body.mass_kg and most == 0.0:
        text = "its inertia_kg_m2 is not given: its mass counts as a point"
        found.append(note(joint.name, text, "give it if the link is large for the way it moves"))
    if body.mass_kg > _HEAVY_KG:
        found.append(warning(joint.name, f"a mass of {body.mass_kg:g} kg", "give mass_kg in kilograms"))
    return found


def _of(joint: DrivenJoint) -> list[Finding]:
    found = margin(joint)
    if found is None or found >= ENOUGH:
        return []
    holding = float(held_nm(joint, 0.0))
    if gravity_nm(joint) >= holding:
        text = (
            f"gravity asks {gravity_nm(joint):.2g} Nm of its motor, which holds {holding:g}: the joint falls"
        )
        return [
            error(
                joint.name,
                text,
                f"use {'a finer screw' if joint.slides else 'a larger gear ratio'} or a stronger motor, or correct "
                "[joint.model]",
            )
        ]
    text = f"its motor has {found:.2g} times the torque that gravity and acceleration ask at its limits"
    keys = (joint.unit.key(name) for name in ("acceleration_deg_s2", "speed_deg_s"))
    next_step = f"lower {' or '.join(keys)}, or correct [joint.model]"
    if found < 1.0:
        return [error(joint.name, f"{text}: it loses steps", next_step)]
    return [warning(joint.name, f"{text}; {ENOUGH:g} is prudent", next_step)]
