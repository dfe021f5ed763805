"""Named postures of an arm file."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

from armtempo.basics.arguments import checked_fields
from armtempo.basics.errors import InputError
from armtempo.basics.toml_table import Table
from armtempo.model import frame, tool_pose
from armtempo.model.frame import ArmFrame
from armtempo.model.joint_unit import NEUTRAL, PositionTexts
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


def read(
    tables: Table,
    name: str,
    texts: PositionTexts,
    frames: tuple[ArmFrame, ...],
    home_deg: Sequence[float],
) -> ArmPosture:
    """The posture ``name`` of the table [posture]; ``home_deg``: of all joints. Raises InputError if it is none."""
    where = f"{tables.file}: posture.{name}"
    table = tables.table(name)
    if problem := name_problem(name):
        raise InputError(f"{where}: {problem}", "choose another name")
    if table is None:
        raise tables.fail(name, "a table")
    listed = given_key(table, texts, "angles_deg")
    forms = [key for key in (listed, "matrix", "position_mm") if table.has(key)]
    if len(forms) != 1:
        raise InputError(
            f"{where}: exactly one of {texts.list_key('angles_deg')}, matrix and position_mm is needed",
            "give one of them",
        )
    if forms == [listed]:
        found = ArmPosture(name, table.numbers(listed, len(texts.names)))
    else:
        pose = tool_pose.from_table(table, where)
        pose = frame.pose_in_base(pose, frames, frame.named(table, frames), where)
        found = ArmPosture(name, replace(pose, posture_deg=tuple(home_deg)))
    table.done()
    return found


def given_key(table: Table, texts: PositionTexts, name: str) -> str:
    """The key by which a file gives a list of joint positions, if it does: ``name``, or that for any unit.

    Raises InputError if it is in degrees for an arm with a sliding joint, or given twice.
    """
    neutral = NEUTRAL[name]
    if table.has(name) and texts.sliding:
        slide = "slides" if len(texts.sliding) == 1 else "slide"
        raise InputError(
            f"{table.file}: {table.place}{name}: {' and '.join(texts.sliding)} {slide}, so a list in degrees "
            "cannot say where the arm is",
            f"write {neutral} = [...], in the order of the joints: {texts.with_units}",
        )
    if table.has(name) and table.has(neutral):
        raise table.misplaced(neutral, f"leave it out beside {name}, which says the same")
    return neutral if table.has(neutral) else name
