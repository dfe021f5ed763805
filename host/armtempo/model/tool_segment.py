"""Requirements for the tool between two via points: a straight line, an arc, a speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from armtempo.basics import json_codec
from armtempo.basics.arguments import checked_fields
from armtempo.basics.errors import InputError
from armtempo.basics.toml_table import Table
from armtempo.model.tool_pose import BASE

LINE_TOLERANCE_MM, LINE_TOLERANCE_DEG = 0.5, 0.5
"""Default tolerances of a line or an arc."""
TOLERANCE_MM, TOLERANCE_DEG = (0.01, 100.0), (0.01, 90.0)
"""Least and largest values."""
LEAST = 1e-3
"""Least speed, acceleration and size of a cut corner."""
MOST = 1e6
POINTS = ("arc_through_mm", "circle_through_mm")
KEYS = ("line", *POINTS, "blend_mm", "speed_mm_s", "acceleration_mm_s2")
"""Keys of a via point's table for the way to it."""


@checked_fields
@dataclass(frozen=True)
class ToolSegment:
    """The path of the tool from the previous via point to via point ``via`` (from 0)."""

    via: int
    line: bool = False
    """The tool follows the straight line, or with ``arc_through_mm`` the arc, and turns evenly."""
    arc_through_mm: tuple[float, ...] | None = None
    """A point (3,) between the via points."""
    tolerance_mm: float = LINE_TOLERANCE_MM
    tolerance_deg: float = LINE_TOLERANCE_DEG
    """Largest deviation of the tool."""
    blend_mm: float = 0.0
    """Distance before and after the via point at which the corner to the next line is cut; 0: stop there."""
    speed_mm_s: float | None = None
    acceleration_mm_s2: float | None = None
    """The tool's limits; None: those of the job."""
    circle_through_mm: tuple[tuple[float, ...], ...] | None = field(default=None, metadata=json_codec.ADDED)
    """Two points (3,) of a full circle, which ends where it began."""
    frame: str = field(default=BASE, metadata=json_codec.ADDED)
    """The frame of the arm in which the points were given; they are in the base (frame.py)."""

    def __post_init__(self) -> None:
        """Raise InputError for invalid requirements."""
        where = f"the way to P{self.via}"
        if self.via < 1:
            raise InputError(f"{where}: nothing leads there", "give line at a later via point")
        if self.arc_through_mm is not None and (not self.line or len(self.arc_through_mm) != 3):
            raise InputError(
                f"{where}: an arc goes through a point x, y, z", "give 3 numbers, and line = true"
            )
        circle = self.circle_through_mm
        if circle is not None and (
            not self.line or self.arc_through_mm or [len(point) for point in circle] != [3, 3]
        ):
            raise InputError(
                f"{where}: a full circle goes through two points x, y, z",
                "give 2 lists of 3 numbers, line = true, and no arc_through_mm",
            )
        if self.blend_mm and not self.line:
            raise InputError(f"{where}: blend_mm cuts the corner at the end of a line", "add line = true")
        for key, (least, most) in (("tolerance_mm", TOLERANCE_MM), ("tolerance_deg", TOLERANCE_DEG)):
            if not least <= getattr(self, key) <= most:
                raise InputError(
                    f"{where}: {key} {getattr(self, key):g} is not allowed", f"give {least:g} to {most:g}"
                )
        for key in ("blend_mm", "speed_mm_s", "acceleration_mm_s2"):
            value = getattr(self, key)
            if value is None or (key == "blend_mm" and value == 0.0):
                continue
            if not LEAST <= value <= MOST:
                raise InputError(f"{where}: {key} {value:g} is not allowed", f"give {LEAST:g} to {MOST:g}")


def read(table: Table, via: int) -> ToolSegment | None:
    """The requirements in a via point's table, None without any; raises InputError for invalid ones."""
    if not any(table.has(key) for key in KEYS):
        table.known(*KEYS)
        return None
    arc = table.numbers("arc_through_mm", 3) if table.has("arc_through_mm") else None
    circle = _circle(table)
    line = table.boolean("line", arc is not None or circle is not None)
    if via == 0:
        key = next(key for key in KEYS if table.has(key))
        raise table.misplaced(key, "leave it out: the motion begins at the first via point")
    if (arc or circle) and not line:
        raise table.fail("line", "true with arc_through_mm and circle_through_mm")
    if arc and circle:
        raise table.misplaced("circle_through_mm", "leave it out, or arc_through_mm")
    if table.has("blend_mm") and not line:
        raise table.misplaced("blend_mm", "leave it out, or give line = true too")
    return ToolSegment(
        via,
        line,
        arc,
        _tolerance(table, "tolerance_mm", TOLERANCE_MM, LINE_TOLERANCE_MM) if line else LINE_TOLERANCE_MM,
        _tolerance(table, "tolerance_deg", TOLERANCE_DEG, LINE_TOLERANCE_DEG) if line else LINE_TOLERANCE_DEG,
        table.number("blend_mm", least=LEAST, most=MOST) if table.has("blend_mm") else 0.0,
        limit(table, "speed_mm_s"),
        limit(table, "acceleration_mm_s2"),
        circle,
    )


def _circle(table: Table) -> tuple[tuple[float, ...], ...] | None:
    if not table.has("circle_through_mm"):
        return None
    points = table.array("circle_through_mm", "two points [x, y, z]")
    if len(points) != 2:
        raise table.fail("circle_through_mm", "two points [x, y, z]")
    both = Table(
        dict(zip(("point 1", "point 2"), points, strict=True)), table.file, f"{table.place}circle_through_mm "
    )
    return both.numbers("point 1", 3), both.numbers("point 2", 3)


def _tolerance(table: Table, key: str, allowed: tuple[float, float], default: float) -> float:
    return table.number(key, default, least=allowed[0], most=allowed[1])


def limit(table: Table, key: str) -> float | None:
    """A limit of the tool, None if it is not given."""
    return table.number(key, least=LEAST, most=MOST) if table.has(key) else None


def at(segments: Sequence[ToolSegment], via: int) -> ToolSegment | None:
    """The requirements for the way to this via point, None without any."""
    return next((segment for segment in segments if segment.via == via), None)
