"""Postures by name: where an arm is to stand, as its file says it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from armtempo.basics.errors import InputError
from armtempo.formats.spelling import did_you_mean
from armtempo.model.tool_pose import Pose

if TYPE_CHECKING:
    from armtempo.model.arm import Arm

HOME = "home"
"""The posture of the joints' ``home_deg``; no other has this name."""
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")
_VIA = re.compile(r"[Pp]\d+")
_NUMBERS = ("nan", "inf", "infinity")
_REACHES_MM = 1e-6


@dataclass(frozen=True)
class ArmPosture:
    """A posture that has a name."""

    name: str
    where: tuple[float, ...] | Pose
    """The driven joints' angles in degrees, (J,), or a tool pose; of its solutions the one nearest to home."""


def is_via(text: str) -> bool:
    """Whether the text means a via point of a job, such as P0."""
    return bool(_VIA.fullmatch(text))


def name_problem(name: str) -> str:
    """What is wrong with a name, in words; "" for a good one."""
    if name == HOME:
        return f"{HOME!r} is the posture of the joints' home_deg"
    if is_via(name):
        return f"{name!r} means a via point of a job"
    if not _NAME.fullmatch(name) or name.lower() in _NUMBERS:
        return f"{name!r} is no name: it begins with a letter and has letters, digits, - and _"
    return ""


def angles_problem(arm: Arm, angles_deg: Sequence[float]) -> str:
    """Why the arm cannot stand at these angles, in words; "" where it can."""
    if len(angles_deg) != len(arm.driven):
        return f"{len(angles_deg)} angles, but {len(arm.driven)} joints have a motor"
    for joint, angle in zip(arm.driven, angles_deg, strict=True):
        low, high = joint.range_deg
        if not low <= angle <= high:
            return f"{joint.name}: {angle:g} degrees is outside of its range {low:g} to {high:g}"
    return ""


def problem(arm: Arm, posture: ArmPosture) -> str:
    """What can be seen to be wrong with a posture without the inverse kinematics, in words; "" for nothing."""
    if found := name_problem(posture.name):
        return found
    if not isinstance(posture.where, Pose):
        return angles_problem(arm, posture.where)
    reach_mm = sum((joint.d_mm**2 + joint.a_mm**2) ** 0.5 for joint in arm.joints)
    away_mm = sum(row[3] ** 2 for row in posture.where.matrix[:3]) ** 0.5
    if away_mm > reach_mm + posture.where.tolerance_mm + _REACHES_MM:
        return f"{away_mm:g} mm from the base, but all links together are {reach_mm:g} mm long"
    return ""


def unknown(arm: Arm, name: str) -> InputError:
    """The error for a posture that the arm file does not have."""
    names = [HOME, *(posture.name for posture in arm.postures)]
    near = did_you_mean(name, names)
    return InputError(
        f"arm {arm.name!r} has no posture {name!r}{near}",
        f"known: {', '.join(names)}; 'armtempo teach --posture {name}' adds where the arm stands",
    )
