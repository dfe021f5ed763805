"""The description of the arm for the virtual board's process."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from armtempo_shared import armrecord

from armtempo.basics.errors import InputError
from armtempo.model.arm import Arm
from armtempo.model.parts import DrivenJoint
from armtempo.records import encode


def describe(arm: Arm, start_deg: Sequence[float] | None = None) -> dict[str, Any]:
    """The arm record's fields and, per joint, where it is at power-up and its drive's model.

    ``start_deg`` (J,): None means the home posture. Raises InputError if a model makes no sense.
    """
    head, rows, _ = armrecord.unpack(encode.arm_record(arm))
    angles = start_deg if start_deg is not None else [joint.home_deg for joint in arm.driven]
    return {
        "head": head,
        "joints": [
            {**row, "start_deg": float(angle), **_joint(joint)}
            for row, angle, joint in zip(rows, angles, arm.driven, strict=True)
        ],
    }


def _joint(joint: DrivenJoint) -> dict[str, Any]:
    model, motor = joint.model, joint.motor
    if model.holding_torque_nm and not (model.inertia_kg_m2 or model.rotor_inertia_kg_m2):
        raise InputError(
            f"{joint.name}: model.holding_torque_nm without an inertia",
            "give model.inertia_kg_m2 or model.rotor_inertia_kg_m2 in the arm file",
        )
    return {
        "steps_per_deg": motor.steps_per_deg,
        "gear_ratio": motor.gear_ratio,
        "microsteps": motor.microsteps,
        "low_deg": joint.switches.low_deg,
        "high_deg": joint.switches.high_deg,
        "model": asdict(model),
    }
