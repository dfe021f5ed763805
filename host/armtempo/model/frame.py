"""Frames around an arm, such as a tray's; what is given in one is turned into the base here, and nowhere else."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from armtempo.basics.arguments import checked_fields
from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.basics.text import did_you_mean
from armtempo.basics.toml_table import Table
from armtempo.model import outputs_file, pose, tool_pose
from armtempo.model.tool_pose import APPROACH, BASE, WHOLE, Pose, Rows, rows_of
from armtempo.model.tool_segment import ToolSegment

KIND = "frame"
"""The tables [frame.NAME] of an arm file."""
TOOL = "tool"
_RESERVED = {BASE: "the frame of the arm itself", TOOL: "the frame of its tool"}
_LEVEL = 1e-9
"""Sine of the angle between two vertical axes."""
WHOLE_ORIENTATION = "give rpy_deg, a quaternion or a matrix, or single angles, of which the others are 0"


@checked_fields
@dataclass(frozen=True)
class ArmFrame:
    """A frame by its pose in another one, or in the base."""

    name: str
    matrix: Rows
    """Its pose: 4 rows of 4, lengths in mm."""
    frame: str = BASE
    """The frame in which the pose is given."""

    def __post_init__(self) -> None:
        """Raise InputError for a name that is not allowed, or a matrix that is no pose."""
        check_name(self.name)
        where = f"{KIND}.{self.name}"
        object.__setattr__(self, "matrix", rows_of(pose.checked(self.matrix, where)))


def check_name(name: str, place: str = "") -> None:
    """Raise InputError, which begins with ``place``, for a name that no frame may have."""
    if name in _RESERVED:
        raise InputError(f"{place}{KIND}.{name}: {name!r} is {_RESERVED[name]}", "choose another name")
    outputs_file.check_name(f"{place}{KIND}.{name}", name)


def read(top: Table) -> tuple[ArmFrame, ...]:
    """The tables [frame.NAME] of an arm file; raises InputError, with file, key and value, for invalid ones."""
    found = tuple(_frame(name, table) for name, table in outputs_file.named(top, KIND))
    check(found, top.file)
    return found


def _frame(name: str, table: Table) -> ArmFrame:
    check_name(name, f"{table.file}: ")
    if table.has("approach"):
        raise InputError(
            f"{table.file}: {table.place}approach does not say how a frame is turned about its own z axis",
            WHOLE_ORIENTATION,
        )
    parent = table.text("frame", BASE)
    found = tool_pose.given(table, f"{table.file}: frame.{name}")
    table.done()
    return ArmFrame(name, found.matrix, parent)


def check(frames: Sequence[ArmFrame], where: str) -> None:
    """Raise InputError, which begins with ``where``, for two of a name, an unknown parent, or a circle."""
    names = [each.name for each in frames]
    for each in frames:
        if names.count(each.name) > 1:
            raise InputError(f"{where}: two frames are called {each.name!r}", "give each a name of its own")
        try:
            in_base(frames, each.name)
        except InputError as error:
            raise InputError(
                f"{where}: frame.{each.name}.frame = {each.frame!r}: {error.problem}", error.hint
            ) from None


def in_base(frames: Sequence[ArmFrame], name: str) -> Array:
    """The pose of a frame in the base, (4, 4); raises InputError for an unknown frame, or a circle of them."""
    known = {each.name: each for each in frames}
    found = np.eye(4)
    passed: list[str] = []
    while name != BASE:
        if name not in known:
            there = f"there are {', '.join((BASE, *known))}" if known else "the arm file has no [frame.NAME]"
            raise InputError(f"there is no frame {name!r}{did_you_mean(name, (BASE, *known))}", there)
        if name in passed:
            raise InputError(
                f"these frames are given in each other: {' in '.join((*passed, name))}",
                f"give one of them in the {BASE}",
            )
        passed.append(name)
        found = np.array(known[name].matrix) @ found
        name = known[name].frame
    return pose.checked(found) if len(passed) > 1 else found


def named(table: Table, frames: Sequence[ArmFrame], default: str = BASE) -> str:
    """The ``frame`` of a table; raises InputError, with file, key and value, if there is no such frame."""
    if not table.has("frame"):
        table.known("frame")
        return default
    name = table.text("frame")
    try:
        in_base(frames, name)
    except InputError as error:
        raise InputError(
            f"{table.file}: {table.place}frame = {name!r}: {error.problem}", error.hint
        ) from None
    return name


def pose_in_base(given: Pose, frames: Sequence[ArmFrame], name: str, where: str) -> Pose:
    """A pose that is given in a frame, in the base.

    Raises InputError, which begins with ``where``, for an unknown frame, a pose that is not in the base, and for
    single angles in a frame whose z axis is not parallel to the base's: the base has no angles that mean the same.
    """
    if given.frame != BASE:
        raise InputError(f"{where}: the pose was given in frame {given.frame!r}", "give one in the base")
    try:
        frame = in_base(frames, name)
    except InputError as error:
        raise InputError(f"{where}: {error.problem}", error.hint) from None
    if name == BASE:
        return given
    if given.fixed not in (WHOLE, (APPROACH,), ()) and np.hypot(*frame[:2, 2]) > _LEVEL:
        raise InputError(
            f"{where}: {' and '.join(given.fixed)} alone cannot be given in frame {name!r}, whose z axis is not "
            "parallel to the base's",
            f'give rpy_deg or approach, the position alone, or a pose with frame = "{BASE}"',
        )
    matrix = pose.checked(frame @ np.array(given.matrix), where)
    return replace(given, matrix=rows_of(matrix), frame=name)


def segment_in_base(given: ToolSegment, frames: Sequence[ArmFrame], name: str) -> ToolSegment:
    """The points of an arc or circle that are given in a frame, in the base; other segments are unchanged."""
    if name == BASE or not (given.arc_through_mm or given.circle_through_mm):
        return given
    frame = in_base(frames, name)

    def moved(point: tuple[float, ...]) -> tuple[float, ...]:
        return tuple((frame[:3, :3] @ point + frame[:3, 3]).tolist())

    arc, circle = given.arc_through_mm, given.circle_through_mm
    return replace(
        given,
        arc_through_mm=moved(arc) if arc else None,
        circle_through_mm=tuple(map(moved, circle)) if circle else None,
        frame=name,
    )


def changed(before: Sequence[ArmFrame], now: Sequence[ArmFrame], names: Iterable[str]) -> str:
    """Describe how the first of these frames that is not where it was has changed; "" if all are."""
    for name in dict.fromkeys(names):
        try:
            there = in_base(now, name)
        except InputError:
            return f"frame {name!r} is no longer in the arm file"
        was = in_base(before, name)
        if np.array_equal(there, was):
            continue
        moved_mm = float(np.linalg.norm(there[:3, 3] - was[:3, 3]))
        turned_deg = pose.angle_deg(there[:3, :3] @ was[:3, :3].T)
        return f"frame {name!r} has changed since, by {moved_mm:.3g} mm and {turned_deg:.3g} degrees"
    return ""
