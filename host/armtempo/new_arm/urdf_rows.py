"""Denavit-Hartenberg rows (standard convention) of a chain of axes given as lines in space."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.kinematics.geometry import Geometry


class AxisLine(NamedTuple):
    """A joint axis: a point (3,) in mm and a direction (3,) of length 1."""

    point: Array
    direction: Array


class DhRow(NamedTuple):
    """One row; ``joint``: the index of its joint, None for a constant row."""

    joint: int | None
    theta_deg: float
    d_mm: float
    a_mm: float
    alpha_deg: float


@dataclass(frozen=True)
class Near:
    """Tolerances for parallel directions and intersecting lines."""

    angle_rad: float
    length_mm: float


@dataclass(frozen=True)
class _Frame:
    origin: Array
    x: Array
    z: Array


def derive(axes: Sequence[AxisLine], tool: Array, near: Near) -> list[DhRow]:
    """Rows from the base frame over all axes to the frame ``tool`` (4, 4), all joints at 0.

    The base's z axis is treated as an axis before the first, the tool's z axis as one after the last: there
    is a constant row before joint 1 if its axis is not the base's, and one after the last joint if the tool
    is turned or shifted along its z axis and no other row can include that.
    """
    frame = _Frame(np.zeros(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    rows: list[DhRow] = []
    lines = [*axes, AxisLine(tool[:3, 3], tool[:3, 2])]
    for joint, line in zip([None, *range(len(axes))], lines, strict=True):
        row, frame = _to_line(frame, line, joint, near)
        rows.append(row)
    return _without_idle(_finish(rows, frame, tool))


def geometry(rows: Sequence[DhRow], linked: Sequence[int] = (), sliding: Sequence[int] = ()) -> Geometry:
    """The rows as the kinematics take them, lengths in mm; ``linked``: joints that a linkage turns; ``sliding``: that
    slide."""
    return Geometry(
        slides=tuple((number, 0.0) for number, row in enumerate(rows) if row.joint in sliding),
        linked=tuple(number for number, row in enumerate(rows) if row.joint in linked),
        d=tuple(row.d_mm for row in rows),
        a=tuple(row.a_mm for row in rows),
        alpha=tuple(math.radians(row.alpha_deg) for row in rows),
        offset=tuple(math.radians(row.theta_deg) for row in rows),
    )


def rounded(rows: Sequence[DhRow], decimals: int) -> list[DhRow]:
    """The rows rounded to ``decimals``, without -0 and alpha of -180."""
    table = []
    for row in rows:
        theta, d, a, alpha = (round(value, decimals) + 0.0 for value in row[1:])
        table.append(DhRow(row.joint, theta, d, a, 180.0 if alpha == -180.0 else alpha))
    return table


def _to_line(frame: _Frame, line: AxisLine, joint: int | None, near: Near) -> tuple[DhRow, _Frame]:
    """The row whose next z axis lies on ``line``, and the frame after it."""
    across = np.cross(frame.z, line.direction)
    if np.linalg.norm(across) <= near.angle_rad:
        return _to_parallel(frame, line, joint, near)
    between = line.point - frame.origin
    cosine = float(frame.z @ line.direction)
    d = float(between @ frame.z - cosine * (between @ line.direction)) / (1.0 - cosine**2)
    along = float(cosine * (between @ frame.z) - between @ line.direction) / (1.0 - cosine**2)
    normal = across / np.linalg.norm(across)
    if float(normal @ frame.x) < -near.angle_rad:
        normal = -normal
    a = float((line.point + along * line.direction - frame.origin - d * frame.z) @ normal)
    if abs(a) <= near.length_mm:
        a = 0.0
    return _row(frame, line, joint, normal, d, a)


def _to_parallel(frame: _Frame, line: AxisLine, joint: int | None, near: Near) -> tuple[DhRow, _Frame]:
    """Of the common normals of parallel lines, the one through the origin: d = 0."""
    between = line.point - frame.origin
    aside = between - (between @ frame.z) * frame.z
    a = float(np.linalg.norm(aside))
    if a <= near.length_mm:
        normal, a = frame.x, 0.0
    else:
        normal = aside / a
    if float(normal @ frame.x) < -near.angle_rad:
        normal, a = -normal, -a
    row, after = _row(frame, line, joint, normal, 0.0, a)
    return row._replace(alpha_deg=0.0 if float(frame.z @ line.direction) > 0.0 else 180.0), after


def _row(
    frame: _Frame, line: AxisLine, joint: int | None, x: Array, d: float, a: float
) -> tuple[DhRow, _Frame]:
    theta = _turn(frame.x, x, frame.z)
    alpha = _turn(frame.z, line.direction, x)
    x = x - (x @ line.direction) * line.direction
    after = _Frame(frame.origin + d * frame.z + a * x, x / np.linalg.norm(x), line.direction)
    return DhRow(joint, math.degrees(theta), d, a, math.degrees(alpha)), after


def _finish(rows: list[DhRow], frame: _Frame, tool: Array) -> list[DhRow]:
    """Add the rotation and shift along the tool's z axis to the last row, or in one more row."""
    theta = math.degrees(_turn(frame.x, tool[:3, 0], frame.z))
    d = float((tool[:3, 3] - frame.origin) @ frame.z)
    *before, last = rows
    if last.alpha_deg in (0.0, 180.0):  # its own axis shifts the same way, or the opposite one
        sign = 1.0 if last.alpha_deg == 0.0 else -1.0
        last, d = last._replace(d_mm=last.d_mm + sign * d), 0.0
        if last.a_mm == 0.0:
            turned = last.theta_deg + sign * theta
            last, theta = last._replace(theta_deg=(turned + 180.0) % 360.0 - 180.0), 0.0
    return [*before, last, DhRow(None, theta, d, 0.0, 0.0)]


def _without_idle(rows: list[DhRow]) -> list[DhRow]:
    """Remove identity rows, within a thousandth of a degree and of a millimetre."""
    return [row for row in rows if row.joint is not None or any(round(value, 3) for value in row[1:])]


def _turn(start: Array, end: Array, about: Array) -> float:
    """Angle from one direction to another, both perpendicular to ``about``."""
    return math.atan2(float(np.cross(start, end) @ about), float(start @ end))
