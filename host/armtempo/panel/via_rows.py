"""The via points of a job as its file has them: the keys of each, and other ones for where it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from armtempo.basics.errors import InputError
from armtempo.kinematics.of_arm import forward
from armtempo.model import tool_segment
from armtempo.model.arm import Arm
from armtempo.model.joint_unit import NEUTRAL
from armtempo.model.pose import to_rpy_deg
from armtempo.model.tool_pose import BASE, WHOLE
from armtempo.panel.file_editor import text_of

ANGLES, POSE, POSTURE = "angles_deg", "position_mm", "posture"
FORMS = (ANGLES, POSE, "matrix", POSTURE)
"""Keys that say where a via point is, one of them."""
WAY_KEYS = (*tool_segment.KEYS, "stop", "dwell_s")
"""Keys of a via point that are edited as fields, besides where it is."""
_PLACES = 4
"""Decimal places of an angle that is taken from the arm or the picture: 0.0001 deg is less than a step."""
WHERE = (
    *(*FORMS, "rpy_deg", "quaternion", "approach", "posture_deg"),
    *(NEUTRAL[ANGLES], NEUTRAL["posture_deg"]),
    *(f"{name}_deg" for name in WHOLE),
)
"""All keys that say where a via point is."""


@dataclass(frozen=True)
class Via:
    """A via point of the table."""

    form: str
    """The key that says where it is: one of FORMS."""
    values: dict[str, Any] = field(default_factory=dict)
    """Its keys in the file."""
    angles_deg: tuple[float, ...] | None = None
    """The driven joints' angles, degrees (J,); None while a pose has none."""

    def text(self, key: str) -> str:
        """The value of a key as it is typed; "" if it is not given."""
        return text_of(self.values.get(key))


def pose_values(arm: Arm, angles_deg: Sequence[float], frame: str = BASE) -> dict[str, Any]:
    """The keys of a pose of the tool in a frame at angles (J,), with as many components as the arm has joints.

    Raises InputError for an arm with too few joints for one.
    """
    pose = np.linalg.inv(arm.frame(frame)) @ forward(arm, list(angles_deg))
    position = [round(float(value), 3) + 0.0 for value in pose[:3, 3]]
    turns = [round(value, 3) + 0.0 for value in to_rpy_deg(pose)]
    orientations: dict[int, dict[str, Any]] = {
        3: {},
        4: {"pitch_deg": turns[1]},
        5: {"approach": [round(float(value), 6) + 0.0 for value in pose[:3, 2]]},
        6: {"rpy_deg": turns},
    }
    if (joints := len(arm.driven)) not in orientations:
        raise InputError(f"an arm with {joints} driven joints has no pose of its own", "give angles")
    return {POSE: position, **orientations[joints]}


def key_in(table: Any) -> str:
    """The key of a list of positions in a table."""
    return NEUTRAL[ANGLES] if NEUTRAL[ANGLES] in table else ANGLES


def via_of(values: dict[str, Any]) -> Via:
    """The via point of these keys; a pose, or what is no list of numbers, has no angles."""
    form = next((key for key in FORMS if key in values), ANGLES)
    angles = values.get(ANGLES)
    known = form == ANGLES and isinstance(angles, list) and all(type(one) in (int, float) for one in angles)
    return Via(form, values, tuple(map(float, angles)) if known and angles else None)


def rounded(angles_deg: Sequence[float]) -> list[float]:
    """Angles (J,) as a file has them."""
    return [round(float(angle), _PLACES) + 0.0 for angle in angles_deg]


def set_where(table: Any, values: dict[str, Any]) -> None:
    """Say where a via point is by other keys; its frame stays with what is given in it."""
    for key in WHERE:
        table.pop(key, None)
    if POSE not in values and not any(key in table for key in tool_segment.POINTS):
        table.pop("frame", None)
    table.update(values)
