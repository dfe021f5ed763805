"""Checks for wrong units: metres instead of millimetres, radians instead of degrees."""

from __future__ import annotations

import math
from collections.abc import Iterator

from armtempo.basics.arrays import Array
from armtempo.diagnosis.finding import Finding, warning
from armtempo.model.arm import Arm
from armtempo.model.joint_unit import is_range_doubtful, is_speed_doubtful
from armtempo.model.parts import Joint
from armtempo.model.tool_pose import BASE

_SHORT_MM, _TINY_MM = 2.0, 0.02
"""A value between these may be in metres: 2 m is a large robot, 20 mm a small offset."""
_NARROW_DEG = (0.1, 2 * math.pi)
"""A range, and an end of one, that may be in radians."""
_NEAR_RAD = 0.002
_TWISTS = [math.pi * part / 12 for part in range(1, 25)]


def findings(arm: Arm) -> list[Finding]:
    """Lengths that may be in metres, angles that may be in radians."""
    return [*_lengths(arm), *_twists(arm), *_ranges(arm), *_places(arm)]


def position_finding(name: str, position_mm: Array, reach_mm: float) -> Finding | None:
    """A warning if a via point lies at the base, but would lie in reach if it were in metres."""
    distance = math.dist(position_mm, (0.0, 0.0, 0.0))
    if not 0.0 < distance < min(_SHORT_MM, 0.01 * reach_mm):
        return None
    return warning(
        "job",
        f"{name}: its position is {distance:.3g} mm from the origin of the base: is it in metres?",
        f"give it in mm: [{', '.join(f'{1000 * value:g}' for value in position_mm)}]",
    )


def _lengths(arm: Arm) -> Iterator[Finding]:
    lengths = [abs(value) for joint in arm.joints for value in (joint.d_mm, joint.a_mm)]
    for joint in arm.joints:
        for key, value in (("d_mm", joint.d_mm), ("a_mm", joint.a_mm)):
            if _TINY_MM <= abs(value) < _SHORT_MM and 1000 * abs(value) <= 2 * max(
                1000 * _SHORT_MM, *lengths
            ):
                yield warning(
                    joint.name,
                    f"{key} = {value:g}: is it in metres?",
                    f"if so, write {key} = {1000 * value:g}",
                )


def _places(arm: Arm) -> Iterator[Finding]:
    """Frames and tools that are hardly away from what they are given in."""
    places = [
        (f"frame {one.name}", one.matrix, "the base" if one.frame == BASE else f"frame {one.frame!r}")
        for one in arm.frames
    ]
    places += [(f"tool {one.name}", one.matrix, "the frame after the last row") for one in arm.tools]
    for where, matrix, of in places:
        position = [row[3] for row in matrix[:3]]
        away_mm = math.dist(position, (0.0, 0.0, 0.0))
        if 0.0 < away_mm < _SHORT_MM:
            yield warning(
                where,
                f"its origin is {away_mm:.3g} mm from that of {of}: is it in metres?",
                f"if so, write position_mm = [{', '.join(f'{1000 * value:g}' for value in position)}]",
            )


def _twists(arm: Arm) -> Iterator[Finding]:
    for joint in arm.joints:
        for key, value in (("alpha_deg", joint.alpha_deg), ("theta_offset_deg", joint.theta_offset_deg)):
            found = [angle for angle in _TWISTS if abs(abs(value) - angle) < _NEAR_RAD]
            if found and value != round(value):
                right = math.copysign(math.degrees(found[0]), value)
                yield warning(
                    joint.name, f"{key} = {value:g}: is it in radians?", f"if so, write {key} = {right:g}"
                )


def _ranges(arm: Arm) -> Iterator[Finding]:
    for joint in arm.joints:
        if joint.slides:
            continue
        low, high = joint.range_deg
        if is_range_doubtful(joint.range_deg):
            right = f"[{math.radians(low):.4g}, {math.radians(high):.4g}]"
            yield warning(
                joint.name,
                f"range_deg = [{low:g}, {high:g}], in rad {right}: were degrees taken as radians?",
                f"if so, write range_deg = {right}",
            )
        if joint.limits and is_speed_doubtful(speed := joint.limits.speed_deg_s):
            right = f"{math.radians(speed):.4g}"
            yield warning(
                joint.name,
                f"speed_deg_s = {speed:g}, {right} rad/s: were degrees/s taken as rad/s?",
                f"if so, write speed_deg_s = {right}",
            )
        least, most = _NARROW_DEG
        if high - low > least and max(abs(low), abs(high)) <= most + _NEAR_RAD and _is_fraction(joint):
            right = f"[{math.degrees(low):.4g}, {math.degrees(high):.4g}]"
            yield warning(
                joint.name,
                f"range_deg = [{low:g}, {high:g}]: is it in radians?",
                f"if so, write range_deg = {right}, and its limits in degrees too",
            )


def _is_fraction(joint: Joint) -> bool:
    return any(round(value, 1) != value for value in joint.range_deg)
