"""Checks of the table and the ranges: postures in which the arm touches its base plane or itself."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.diagnosis.finding import Finding, error, note, warning
from armtempo.kinematics import Geometry
from armtempo.kinematics.chain import outline_mm
from armtempo.model.arm import Arm
from armtempo.model.parts import DrivenJoint

_BELOW_MM = 1.0
_NEAR = 0.01
"""Distance of links, as a fraction of the reach, below which there is a finding."""
_FULL_TURN_DEG = 360.0


class End(NamedTuple):
    """The arm at home, with one joint at an end of its range."""

    joint: DrivenJoint
    angle_deg: float
    points_mm: Array
    """(2 joints + 1, 3), as ``outline_mm`` gives them."""


def findings(arm: Arm) -> list[Finding]:
    """Findings about the table, the home posture and the ends of the ranges."""
    if Geometry.of(arm).reach == 0.0 and not any(joint.d_mm for joint in arm.joints):
        return [error("geometry", "all lengths are 0", "give d_mm and a_mm of the joints, in mm")]
    return [*_home(arm), *_ends(arm), *_wide(arm), *_frames(arm)]


def ends(arm: Arm) -> Iterator[End]:
    """The arm with each driven joint at each end of its range, the others at their home angles."""
    for index, joint in zip(arm.driven_indices, arm.driven, strict=True):
        for angle_deg in joint.range_deg:
            angles = np.array(arm.all_home_deg)
            angles[index] = angle_deg
            yield End(joint, angle_deg, outline_mm(arm, angles))


def _home(arm: Arm) -> list[Finding]:
    points, near = outline_mm(arm, np.array(arm.all_home_deg)), _NEAR * Geometry.of(arm).reach
    found = []
    if (lowest := float(np.min(points[:, 2]))) < -_BELOW_MM:
        text = f"the home posture goes {-lowest:.0f} mm below the base plane (z = 0)"
        found.append(
            warning("geometry", text, "look at the picture (--picture); check home_deg and the table's signs")
        )
    if (gap := _gap_mm(points, near)) < near:
        text = f"in the home posture links come within {gap:.0f} mm of each other"
        found.append(
            warning("geometry", text, "look at the picture (--picture); check home_deg and the table's signs")
        )
    return found


def _frames(arm: Arm) -> list[Finding]:
    """Frames whose origin the tool cannot come to, and pallets with a place that it cannot."""
    reach_mm = Geometry.of(arm).reach + abs(arm.joints[0].d_mm)
    reach_mm += max((tool.length_mm for tool in arm.tools), default=0.0)
    found = []
    for each in arm.frames:
        away_mm = float(np.linalg.norm(arm.frame(each.name)[:3, 3]))
        if away_mm > reach_mm:
            text = (
                f"its origin is {away_mm:.0f} mm from the base, but all links, with the longest tool, are "
                f"{reach_mm:.0f} mm long"
            )
            found.append(
                note(f"frame {each.name}", text, "check its position_mm, and the frame that it is in")
            )
    for pallet in arm.pallets:
        numbers = range(1, pallet.places + 1)
        away = [np.linalg.norm(np.array(pallet.pose(n, arm.frames).matrix)[:3, 3]) for n in numbers]
        if max(away) > reach_mm:
            number = int(np.argmax(away))
            text = (
                f"{pallet.describe(number + 1)} is {away[number]:.0f} mm from the base, but all links, with the "
                f"longest tool, are {reach_mm:.0f} mm long"
            )
            found.append(
                note(f"pallet {pallet.name}", text, "check its position_mm, and row_mm, column_mm, layer_mm")
            )
    return found


def _ends(arm: Arm) -> list[Finding]:
    """One note of each kind, as nearly every arm can touch its table and itself within its ranges."""
    near = _NEAR * Geometry.of(arm).reach
    below, crossing = [], []
    for end in ends(arm):
        where = f"{end.joint.name} at {end.angle_deg:g}"
        if (lowest := float(np.min(end.points_mm[:, 2]))) < -_BELOW_MM:
            below.append(f"{where} ({-lowest:.0f} mm)")
        if _gap_mm(end.points_mm, near) < near:
            crossing.append(where)
    found = []
    ranges = " or ".join(dict.fromkeys(joint.unit.key("range_deg") for joint in arm.driven))
    next_step = f"give [workspace] and radius_mm, so that motions are checked for it, or narrow {ranges}"
    if below:
        found.append(
            note("ranges", f"from home, the arm goes below its base plane with {', '.join(below)}", next_step)
        )
    if crossing:
        found.append(note("ranges", f"from home, links collide with {', '.join(crossing)}", next_step))
    return found


def _wide(arm: Arm) -> list[Finding]:
    found = []
    for joint in arm.driven:
        low, high = joint.range_deg
        if high - low > _FULL_TURN_DEG and not joint.slides:
            text = f"its range of {high - low:g} deg is more than a turn"
            found.append(note(joint.name, text, "make sure that the cables allow it"))
    return found


def _gap_mm(points: Array, shortest: float) -> float:
    """Smallest distance between two lines of the outline that are not neighbours; infinite if there are none.

    Lines shorter than ``shortest`` are left out, as their neighbours are close in any posture.
    """
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    links = [(points[i], points[i + 1]) for i in np.flatnonzero(lengths > max(shortest, _BELOW_MM))]
    gaps = [_distance(*links[i], *links[j]) for i in range(len(links)) for j in range(i + 2, len(links))]
    return min(gaps, default=np.inf)


def _distance(a: Array, b: Array, c: Array, d: Array) -> float:
    """Distance between the segments a-b and c-d (C. Ericson, Real-Time Collision Detection, 2005, section 5.1.9)."""
    along, other, between = b - a, d - c, a - c
    aa, bb, cross = along @ along, other @ other, along @ other
    denominator = aa * bb - cross**2
    s = (
        0.0
        if denominator < 1e-12 * aa * bb
        else (cross * (other @ between) - bb * (along @ between)) / denominator
    )
    s = float(np.clip(s, 0.0, 1.0))
    t = float(np.clip((cross * s + other @ between) / bb, 0.0, 1.0))
    s = float(np.clip((cross * t - along @ between) / aa, 0.0, 1.0))
    return float(np.linalg.norm(a + s * along - c - t * other))
