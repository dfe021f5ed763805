"""A frame from three points that the tool was brought to: its origin, a point on its x axis, one on the side of y."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.model import frame, pose
from armtempo.model.arm import Arm
from armtempo.model.tool_pose import BASE

POINTS = ("the origin", "a point on the x axis", "a point on the side of y")
LEAST_TIMES = 100.0
"""The second point is at least this many times as far from the origin, and the third from the x axis, as half a step of
each joint moves the tool: the axes are then right within 1.7 degrees, if the third is beside the first two."""
LEAST_ANGLE_DEG = 10.0
"""Between the directions to the second and the third point, and from the opposite direction."""
MOST_TILT_DEG = 10.0
"""A frame that is tilted by more is not made level."""
_SMALLEST_MM = 0.1
"""Smaller distances are refused whatever the steps are: the file has positions to 0.001 mm."""
_PLACES_MM, _PLACES_DEG = 3, 4


@dataclass(frozen=True, eq=False)
class ThreePoints:
    """A frame by three points, and what they say of how well they were chosen."""

    matrix: Array
    """Its pose in the base, (4, 4)."""
    apart_mm: tuple[float, float]
    """Distances of the second and the third point from the origin."""
    angle_deg: float
    """Between the directions to them."""
    tilt_deg: float
    """Between the plane of the points and the base's."""
    axes_error_deg: float
    """By how much half a step of each joint may turn the axes."""


def of_points(points_mm: Array, step_error_mm: float, level: bool = False) -> ThreePoints:
    """The frame through three points of the tool in the base, (3, 3): POINTS in this order.

    ``step_error_mm``: by how much half a step of each joint moves the tool. ``level``: make its z axis parallel to the
    base's. Raises InputError for points that are too near to each other, or almost on a line.
    """
    check_apart(points_mm, step_error_mm)
    origin = points_mm[0]
    along, aside = points_mm[1] - origin, points_mm[2] - origin
    least_mm = _least_mm(step_error_mm)
    apart_mm = float(np.linalg.norm(along)), float(np.linalg.norm(aside))
    x = along / apart_mm[0]
    across = aside - (aside @ x) * x
    across_mm = float(np.linalg.norm(across))
    angle_deg = float(np.degrees(np.arctan2(across_mm, aside @ x)))
    if not LEAST_ANGLE_DEG <= angle_deg <= 180.0 - LEAST_ANGLE_DEG or across_mm < least_mm:
        raise InputError(
            f"the three points are almost on a line: the third is {across_mm:.3g} mm beside the x axis, "
            f"{angle_deg:.3g} degrees from it",
            f"take one that is at least {least_mm:.3g} mm and {LEAST_ANGLE_DEG:g} degrees beside it",
        )
    z = np.cross(x, across / across_mm)
    tilt_deg = float(np.degrees(np.arccos(np.clip(abs(z[2]), 0.0, 1.0))))
    if level:
        x, z = _level(x, z, tilt_deg)
    matrix = np.eye(4)
    matrix[:3, :3] = np.column_stack((x, np.cross(z, x), z))
    matrix[:3, 3] = origin
    error_deg = np.degrees(step_error_mm * _turn_per_mm(apart_mm[0], float(aside @ x), across_mm))
    return ThreePoints(pose.checked(matrix), apart_mm, angle_deg, tilt_deg, float(error_deg))


def _turn_per_mm(length_mm: float, along_mm: float, across_mm: float) -> float:
    """Rad by which the axes may turn for each mm by which each of the points may be elsewhere, to first order.

    The x axis turns by the errors of its two points over its length. About it the plane turns by the error of the third
    point, and that of the x axis beside it, which grows beyond its ends, over their distance.
    """
    beside = abs(1.0 - along_mm / length_mm) + abs(along_mm / length_mm)
    return float(np.hypot(2.0 / length_mm, (1.0 + beside) / across_mm))


def check_apart(points_mm: Array, step_error_mm: float) -> None:
    """InputError if one of the points (N, 3) is too near to the first; ``step_error_mm`` as in ``of_points``."""
    for number, distance_mm in enumerate(np.linalg.norm(points_mm[1:] - points_mm[0], axis=1), 1):
        if distance_mm < _least_mm(step_error_mm):
            raise InputError(
                f"{POINTS[number]} is {distance_mm:.3g} mm from the origin, too near for the steps of this arm",
                f"take it at least {_least_mm(step_error_mm):.3g} mm away",
            )


def _least_mm(step_error_mm: float) -> float:
    return max(LEAST_TIMES * step_error_mm, _SMALLEST_MM)


def _level(x: Array, z: Array, tilt_deg: float) -> tuple[Array, Array]:
    """The x axis in the horizontal plane, and the vertical z axis, nearest to these."""
    if tilt_deg > MOST_TILT_DEG:
        raise InputError(
            f"the points lie in a plane that is tilted by {tilt_deg:.3g} degrees, which is not made level",
            f"take points on a level plane (within {MOST_TILT_DEG:g} degrees), or leave --level out",
        )
    flat = np.array([x[0], x[1], 0.0])
    return flat / np.linalg.norm(flat), np.array([0.0, 0.0, np.copysign(1.0, z[2])])


def values(arm: Arm, name: str, matrix: Array) -> Mapping[str, Any]:
    """The keys of [frame.NAME] for a pose in the base, (4, 4); a frame that is in another one stays in it."""
    parent = next((each.frame for each in arm.frames if each.name == name), BASE)
    own = pose.checked(np.linalg.inv(frame.in_base(arm.frames, parent)) @ matrix)
    turns = pose.to_rpy_deg(own)
    return {
        **({} if parent == BASE else {"frame": parent}),
        "position_mm": [round(float(value), _PLACES_MM) + 0.0 for value in own[:3, 3]],
        "rpy_deg": [round(value, _PLACES_DEG) + 0.0 for value in turns],
    }
