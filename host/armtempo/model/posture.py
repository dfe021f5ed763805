"""Named postures of an arm file."""

from __future__ import annotations

import re
from dataclasses import dataclass

from armtempo.basics.arguments import checked_fields
from armtempo.model.tool_pose import Pose

HOME = "home"
"""Reserved name: the posture of the joints' ``home_deg``."""
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")
_VIA = re.compile(r"[Pp]\d+")
_NUMBERS = ("nan", "inf", "infinity")


@checked_fields
@dataclass(frozen=True)
class ArmPosture:
    """A named posture."""

    name: str
    where: tuple[float, ...] | Pose
    """The driven joints' angles, degrees (J,), or a tool pose, solved nearest to home."""


def is_via(text: str) -> bool:
    """Whether the text is the name of a job's via point, such as P0."""
    return bool(_VIA.fullmatch(text))


def name_problem(name: str) -> str:
    """What is wrong with a name; "" for a valid one."""
    if name == HOME:
        return f"{HOME!r} is the posture of the joints' home_deg"
    if is_via(name):
        return f"{name!r} is the name of a job's via point"
    if not _NAME.fullmatch(name) or name.lower() in _NUMBERS:
        return f"{name!r} is not a valid name: a letter, then letters, digits, - and _"
    return ""
