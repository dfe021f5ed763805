"""The workspace in which an arm may move, and the table [workspace] of its file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from armtempo.basics import json_codec
from armtempo.basics.arguments import checked_fields
from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.basics.toml_table import Table
from armtempo.model import frame, pose
from armtempo.model.frame import ArmFrame
from armtempo.model.tool_pose import Rows, rows_of

FAR_MM = 1e5
"""Largest coordinate of walls and boxes; a missing wall is here."""


@checked_fields
@dataclass(frozen=True)
class KeepOut:
    """A box that no part of the arm may touch, from its least to its largest corner (3,)."""

    name: str
    low_mm: tuple[float, ...]
    high_mm: tuple[float, ...]
    axes: Rows = field(default=rows_of(np.eye(4)), metadata=json_codec.ADDED)
    """Pose in the base, 4 rows of 4, of the frame whose axes it lies along and in which its corners are."""

    def __post_init__(self) -> None:
        """Raise InputError if it is not a box."""
        object.__setattr__(
            self, "axes", rows_of(pose.checked(self.axes, f"keep-out box {self.name!r}: axes"))
        )
        if (len(self.low_mm), len(self.high_mm)) != (3, 3) or not all(
            low < high for low, high in zip(self.low_mm, self.high_mm, strict=True)
        ):
            raise InputError(
                f"keep-out box {self.name!r}: low_mm and high_mm are not corners of a box",
                "give x, y, z of both, each of low_mm below that of high_mm",
            )

    @property
    def corners_mm(self) -> Array:
        """Its eight corners in the base, (8, 3); the last index of a corner changes fastest."""
        ends = np.array([self.low_mm, self.high_mm])
        local = np.array([[ends[i, 0], ends[j, 1], ends[k, 2]] for i, j, k in np.ndindex(2, 2, 2)])
        axes = np.array(self.axes)
        return np.asarray(local @ axes[:3, :3].T + axes[:3, 3])


@checked_fields
@dataclass(frozen=True)
class Workspace:
    """Boxes to keep out of, and walls: the least and largest x, y and z (FAR_MM for a missing wall)."""

    keep_out: tuple[KeepOut, ...] = ()
    low_mm: tuple[float, ...] = (-FAR_MM,) * 3
    high_mm: tuple[float, ...] = (FAR_MM,) * 3

    @property
    def obstacles(self) -> tuple[KeepOut, ...]:
        """The boxes, then the walls as very large boxes."""
        walls = []
        for axis, letter in enumerate("xyz"):
            for side, end in enumerate((self.low_mm[axis], self.high_mm[axis])):
                name = f"the wall at {letter} = {end:g}" if axis < 2 else ("the floor", "the ceiling")[side]
                if abs(end) < FAR_MM:
                    ends = [[-FAR_MM] * 3, [FAR_MM] * 3]
                    ends[1 - side][axis] = end
                    walls.append(KeepOut(name, tuple(ends[0]), tuple(ends[1])))
        return (*self.keep_out, *walls)


def read(top: Table, frames: Sequence[ArmFrame] = ()) -> Workspace | None:
    """The workspace of an arm file with these frames; None if it has none. Raises InputError for invalid values.

    The table of files written before it had this name is [room].
    """
    table = top.table("workspace" if top.has("workspace") else "room")
    if table is None:
        return None
    low, high = [-FAR_MM] * 3, [FAR_MM] * 3
    for axis, key in enumerate(("x_mm", "y_mm")):
        if table.has(key):
            low[axis], high[axis] = table.numbers(key, 2)
            if not -FAR_MM <= low[axis] < high[axis] <= FAR_MM:
                raise table.fail(key, f"two numbers, the smaller first, of at most {FAR_MM:g} either way")
    if table.has("floor_mm"):
        low[2] = table.number("floor_mm", least=-FAR_MM, most=FAR_MM)
    if table.has("ceiling_mm"):
        high[2] = table.number("ceiling_mm", least=-FAR_MM, most=FAR_MM)
        if high[2] <= low[2]:
            raise table.fail("ceiling_mm", "a number above floor_mm")
    boxes = []
    for box in table.tables("keep_out") if table.has("keep_out") else ():
        axes = rows_of(frame.in_base(frames, frame.named(box, frames)))
        found = KeepOut(box.text("name"), box.numbers("low_mm", 3), box.numbers("high_mm", 3), axes)
        box.done()
        boxes.append(found)
    table.done()
    return Workspace(tuple(boxes), tuple(low), tuple(high))
