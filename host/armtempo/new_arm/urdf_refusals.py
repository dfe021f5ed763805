"""Which joints of a URDF an arm file cannot describe, and why."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from armtempo.basics.errors import InputError
from armtempo.model.parts_file import MAX_ANGLE_DEG
from armtempo.new_arm.urdf_chain import MM

SLIDING = "prismatic"
_WHEEL_JOINTS = 2
"""An axle with its steering; a chain with at most this many joints is an arm only if each has limits."""
_REASONS = {
    "floating": "it is free in all directions, and a motor turns about one axis",
    "planar": "it moves in a plane, and a motor turns about one axis",
}


def check(path: Path, joints: list[Any]) -> None:
    """Raise InputError naming every joint that an arm file cannot describe."""
    found = [f"\n  joint {joint.name!r}: {reason}" for joint, reason in reasons(joints) if reason]
    if found:
        raise InputError(
            f"{path}: this chain does not fit an arm file:{''.join(found)}",
            "choose another chain with --base and --tip, or change the URDF",
        )


def check_wheels(path: Path, moving: list[Any]) -> None:
    """Raise InputError for a chain that is probably a wheel."""
    endless = [joint.name for joint in moving if joint.type == "continuous"]
    if endless and (len(endless) == len(moving) or len(moving) <= _WHEEL_JOINTS):
        raise InputError(
            f"{path}: turning without end, as wheels do: {', '.join(map(repr, endless))}; this chain is not an arm",
            "choose another chain with --base and --tip; a joint of an arm gets limits (type='revolute') in the URDF",
        )


def reasons(chain: Sequence[Any]) -> Iterator[tuple[Any, str]]:
    """The joints of a chain, and why each does not fit; empty if it does."""
    before = None
    for joint in chain:
        yield joint, _reason(joint, before)
        before = before if joint.type == "fixed" else joint


def _reason(joint: Any, before: Any) -> str:
    """Why a joint does not fit; ``before``: the joint that moves before it in the chain."""
    if joint.type == "fixed":
        return ""
    if joint.type not in ("revolute", "continuous", SLIDING):
        return _REASONS.get(joint.type, f"its type is {joint.type!r}")
    if joint.axis is not None and not 0.0 < np.linalg.norm(joint.axis) < math.inf:
        return "its axis has no direction"
    if joint.mimic is not None:
        if joint.type == SLIDING or (before is not None and before.type == SLIDING):
            return f"it mimics {joint.mimic.joint!r}, and one of them slides; an arm file has no such linkage"
        return _mimic_reason(joint.mimic, before)
    if joint.type == SLIDING:
        return _stroke_reason(joint.limit)
    return "" if joint.type == "continuous" else _range_reason(joint.limit)


def _mimic_reason(mimic: Any, before: Any) -> str:
    factor = 1.0 if mimic.multiplier is None else mimic.multiplier
    if before is not None and before.name == mimic.joint and before.mimic is None and factor == -1.0:
        return ""  # a parallelogram
    return (
        f"it mimics {mimic.joint!r} by a factor of {factor:g}; an arm file has only linkages that turn a joint by "
        "minus the angle of the one before it, which moves by itself"
    )


def _range_reason(limit: Any) -> str:
    if limit is None or limit.lower is None or limit.upper is None:
        return "it has no limits; add <limit lower= upper=> with the angles in rad that it may turn to"
    if not limit.lower < limit.upper:
        return f"its limits {limit.lower:g} to {limit.upper:g} rad are no range; correct them"
    if max(abs(limit.lower), abs(limit.upper)) > math.radians(MAX_ANGLE_DEG):
        return f"its limits {limit.lower:g} to {limit.upper:g} rad are more than {MAX_ANGLE_DEG:g} degrees"
    return ""


def _stroke_reason(limit: Any) -> str:
    """Why the limits of a sliding joint are no range."""
    if limit is None or limit.lower is None or limit.upper is None:
        return "it has no limits; add <limit lower= upper=> with the positions in m that it may slide to"
    if not limit.lower < limit.upper:
        return f"its limits {limit.lower:g} to {limit.upper:g} m are no range; correct them"
    if MM * max(abs(limit.lower), abs(limit.upper)) > MAX_ANGLE_DEG:
        return f"its limits {limit.lower:g} to {limit.upper:g} m are more than {MAX_ANGLE_DEG / MM:g} m"
    return ""
