"""Coupled joints of an arm: what the board cannot do with them, and what their motors reach."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from armtempo.model.parts import DrivenJoint, Joint, Limits
from armtempo.model.transmission import Transmission


def board_problem(
    joints: tuple[Joint, ...], homing: tuple[tuple[str, ...], ...], gears: Transmission
) -> tuple[str, str] | None:
    """What the board cannot do with coupled joints, and what to do; None for nothing.

    It knows motors only: it compares an encoder with its own motor, and sees by the direction of one motor whether a
    joint moves towards its switch.
    """
    for number, joint in enumerate(joints):
        if gears.is_alone(number):
            continue
        others = ", ".join(joints[other].name for other in gears.group(number) if other != number)
        if joint.encoder is not None and joint.encoder.on == "joint":
            return (
                f"{joint.name} is coupled with {others}, so its encoder cannot be on the joint",
                'mount it on the motor, with on = "motor"',
            )
        if isinstance(joint.switches.low, int) or isinstance(joint.switches.high, int):
            return (
                f"{joint.name} is coupled with {others}, so its switches can be used for homing only",
                'connect them to free pins such as "PD0" instead of the inputs 1 to 3',
            )
    for group in gears.groups:
        names = {joints[number].name for number in group}
        together = next((entry for entry in homing if len(names.intersection(entry)) > 1), ())
        if together:
            listed = ", ".join(name for name in together if name in names)
            return (
                f"homing: {listed} are coupled, so they cannot be homed together",
                "list them one after the other",
            )
    return None


def motors(driven: tuple[DrivenJoint, ...], gears: Transmission) -> tuple[DrivenJoint, ...]:
    """The driven joints with range and limits of their motors behind the gears: what these reach with each joint
    anywhere in its own."""
    if not gears.coupling:
        return driven
    reached = (
        np.array([joint.range_deg for joint in driven]).T[:, None, :] * gears.matrix
    )  # (2, motors, joints)
    ranges = np.stack([reached.min(axis=0).sum(axis=1), reached.max(axis=0).sum(axis=1)], axis=1).tolist()
    limits = gears.largest_motors_deg(np.array([joint.limits.values for joint in driven]).T).T.tolist()
    return tuple(
        replace(
            joint,
            name=_motor_name(driven, row, joint),
            range_deg=tuple(span),
            limits=Limits(*most),
            step_share=1.0,
        )
        for joint, row, span, most in zip(driven, gears.coupling, ranges, limits, strict=True)
    )


def _motor_name(driven: tuple[DrivenJoint, ...], row: tuple[float, ...], own: DrivenJoint) -> str:
    others = [joint.name for joint, factor in zip(driven, row, strict=True) if factor and joint is not own]
    return f"{own.name} (its motor, which also moves {' and '.join(others)})" if others else own.name
