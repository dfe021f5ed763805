"""Where the arm file of a new project comes from: an arm that ships, a URDF, or joints one by one."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from armtempo.basics import toml_table
from armtempo.basics.errors import InputError
from armtempo.model import shipped
from armtempo.model.arm import Arm
from armtempo.new_arm import joint_entry
from armtempo.new_arm.joint_entry import JointEntry


@dataclass(frozen=True)
class ArmText:
    """An arm file that is yet to be written."""

    text: str
    arm: Arm
    """What the reader makes of it."""


def from_shipped(name: str) -> ArmText:
    """The file of an arm that ships, to be changed to the user's own motors and wiring.

    Raises InputError, naming those that ship, for another name.
    """
    files = shipped.files()
    if name not in files:
        raise InputError(
            f"{name}: no arm of that name ships with armtempo", f"give one of {', '.join(files)}"
        )
    return _checked(files[name].read_text(encoding="utf-8"))


def from_urdf(urdf: Path) -> ArmText:
    """The arm of a URDF; its motors are left as comments. Raises InputError as ``urdf.reader`` does."""
    from armtempo.new_arm import arm_text
    from armtempo.new_arm import urdf_fitting as fitting
    from armtempo.new_arm import urdf_reader as reader

    chain = reader.read(urdf, None, None)
    return _checked(arm_text.arm_text(chain, fitting.fit(chain), urdf))


def from_joints(name: str, joints: Sequence[JointEntry], modified: bool = False) -> ArmText:
    """An arm of these joints, base first. Raises InputError for what an arm file does not allow.

    ``modified``: ``a_mm`` and ``alpha_deg`` of a joint are those from the axis before to its own, as in J. J. Craig,
    Introduction to Robotics, section 3.4. In an arm file they belong to the row before; to a constant one at the base.
    """
    base = []
    if modified:
        first = joints[0]
        if first.a_mm or first.alpha_deg:
            base = [joint_entry.constant("base", first.a_mm, first.alpha_deg)]
        behind = [*((joint.a_mm, joint.alpha_deg) for joint in joints[1:]), (0.0, 0.0)]
        joints = [
            replace(joint, a_mm=a_mm, alpha_deg=alpha_deg)
            for joint, (a_mm, alpha_deg) in zip(joints, behind, strict=True)
        ]
    tables = [joint_entry.table(joint, number, len(joints)) for number, joint in enumerate(joints, 1)]
    return _checked("\n".join([f"name = {json.dumps(name, ensure_ascii=False)}\n", *base, *tables]))


def _checked(text: str) -> ArmText:
    """Raises InputError for a text that could not be read again."""
    return ArmText(text, Arm.of_table(toml_table.parse(text, "arm.toml")))
