"""Postures by name, as an arm file has them."""

from __future__ import annotations

import re
from dataclasses import dataclass

from armtempo.basics.arguments import checked_fields
from armtempo.model.tool_pose import Pose

HOME = "home"
"""The posture of the joints' ``home_deg``; no other has this name."""
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")
_VIA = re.compile(r"[Pp]\d+")
_NUMBERS = ("nan", "inf", "infinity")


@checked_fields
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
