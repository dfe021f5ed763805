"""The joints' angles along a path of the tool, each posture next to the one before.

The arm stays in its branch, or passes a singular posture where the tool's path leads through it; if the joints cannot
follow, the error says at which place and why.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.errors import PlanError
from armtempo.kinematics.chain import all_angles_deg
from armtempo.kinematics.geometry import Geometry
from armtempo.kinematics.shape import refusals
from armtempo.kinematics.solutions import branch_of
from armtempo.model.arm import Arm
from armtempo.model.tool_pose import APPROACH, WHOLE
from armtempo.planning.line.tool_path import ToolPath, rotation_vectors
from armtempo.planning.tool import Tool

STEPS = 32
"""Least number of places along a path."""
_MOST_STEP_DEG = 4.0
"""Largest turn of a joint between two postures."""
_FINEST = 2.0**-14
"""Smallest step, as a fraction of the path."""
_NEWTON_STEPS = 12
_ON_IT = 1e-9
"""Tolerance of a posture on the path, as a fraction of the reach, or rad."""
_DROPPED = 1e-9
"""Smaller singular values, relative to the largest, count as 0."""
_SINGULAR = 0.02
"""Least singular value of the Jacobian, lengths as parts of the reach: smaller ones are called singular."""
_STRAIGHT = 0.05
"""rad; a part of the arm is straight if a turn of its joint by this changes the branch."""


@dataclass(frozen=True, eq=False)
class Course:
    """A path of the tool for an arm, with the constrained part of the orientation: WHOLE, (APPROACH,) or ()."""

    arm: Arm
    path: ToolPath
    fixed: tuple[str, ...]
    name: str
    """Name in messages: "P1 to P2"."""

    def place(self, distance: float) -> str:
        """Describe a place on it."""
        return f"{self.name}, at {max(distance, 0.0):.1f} of {self.path.length:.1f} mm"


@dataclass(frozen=True, eq=False)
class Followed:
    """Postures along a course."""

    course: Course
    tool: Tool
    distances: Array
    """(K,), from 0."""
    angles_deg: Array
    """(K, J)."""

    @property
    def end_deg(self) -> Array:
        """End posture, (J,)."""
        return np.asarray(self.angles_deg[-1])

    def at(self, distances: Array) -> Array:
        """The postures at distances (N,), exactly on the course: (N, J)."""
        near = np.stack(
            [np.interp(distances, self.distances, column) for column in self.angles_deg.T], axis=1
        )
        if _is_loose(self.course, self.tool):
            from scipy.interpolate import CubicSpline  # its import takes longer than most commands

            near = CubicSpline(self.distances, self.angles_deg)(distances)
        angles, missed = _corrected(self.course, self.tool, distances, near)
        worst = int(np.argmax(missed))
        if not missed[worst] <= _ON_IT:
            raise _stuck(self.course, self.tool, float(distances[worst]), near[worst])
        return angles


def follow(course: Course, start_deg: Array, end_deg: Array | None = None) -> Followed:
    """The postures along the course from ``start_deg`` (J,), at its start.

    A redundant arm moves evenly to ``end_deg``, if given. Raises PlanError, naming the place, if a joint
    leaves its range or cannot follow.
    """
    tool = Tool(course.arm, list(range(len(course.arm.driven))), start_deg)
    length, step = course.path.length, 1.0 / STEPS
    evenly = end_deg is not None and _is_loose(course, tool)
    places, postures = [0.0], [np.asarray(start_deg, dtype=float)]
    while places[-1] < 1.0:
        step = min(step, 1.0 - places[-1])
        place = places[-1] + step if 1.0 - places[-1] - step > 1e-9 else 1.0
        distances = np.array([place * length])
        near = _extrapolated(places, postures, place)
        if evenly and end_deg is not None:
            near = postures[0] + place * (end_deg - postures[0])
        angles, missed = _corrected(course, tool, distances, near[None])
        if missed[0] <= _ON_IT and np.max(np.abs(angles[0] - postures[-1])) <= _MOST_STEP_DEG:
            _check_range(course, float(distances[0]), angles[0])
            places.append(place)
            postures.append(angles[0])
            step = min(2.0 * step, 1.0 / STEPS)
        elif step > _FINEST:
            step *= 0.5
        else:
            raise _stuck(course, tool, float(places[-1] * length), postures[-1])
    return Followed(course, tool, np.array(places) * length, np.array(postures))


def _extrapolated(places: list[float], postures: list[Array], place: float) -> Array:
    """Extrapolation from the last two postures."""
    if len(places) < 2:
        return postures[-1]
    part = (place - places[-1]) / (places[-1] - places[-2])
    return np.asarray(postures[-1] + min(part, 2.0) * (postures[-1] - postures[-2]))


def _corrected(course: Course, tool: Tool, distances: Array, near_deg: Array) -> tuple[Array, Array]:
    """Postures on the course near given ones (N, J), and their residuals, (N,)."""
    position, rotation = course.path.poses(distances)
    angles = near_deg.copy()
    missed = np.full(len(distances), np.inf)
    for _ in range(_NEWTON_STEPS):
        gap, slope = _gap(course, tool, position, rotation, angles)
        missed = np.abs(gap).max(axis=1)
        if not np.all(np.isfinite(gap)) or missed.max() <= 1e-2 * _ON_IT:
            break
        step = np.linalg.pinv(slope, rcond=_DROPPED) @ gap[:, :, None]
        angles = angles + np.clip(step[:, :, 0], -10.0 * _MOST_STEP_DEG, 10.0 * _MOST_STEP_DEG)
    return angles, missed


def _gap(
    course: Course, tool: Tool, position: Array, rotation: Array, angles_deg: Array
) -> tuple[Array, Array]:
    """Residuals of postures (N, J) against poses, and their Jacobian: (N, M) and (N, M, J)."""
    state = tool.at(angles_deg)
    reach = float(tool.reach_mm.max()) or 1.0
    gaps = [(position - state.position_mm) / reach]
    slopes = [state.slope_mm_deg / reach]
    if course.fixed == WHOLE:
        gaps.append(rotation_vectors(rotation @ np.swapaxes(state.rotation, 1, 2)))
        slopes.append(state.axes_deg)
    elif course.fixed == (APPROACH,):
        axis = state.rotation[:, :, 2]
        gaps.append(rotation[:, :, 2] - axis)
        slopes.append(np.cross(state.axes_deg, axis[:, :, None], axis=1))
    return np.concatenate(gaps, axis=1), np.concatenate(slopes, axis=1)


def _rank(fixed: tuple[str, ...]) -> int:
    return 6 if fixed == WHOLE else 5 if fixed else 3


def _is_loose(course: Course, tool: Tool) -> bool:
    """Whether the arm is redundant on the course."""
    return bool(tool.turns.shape[1] > _rank(course.fixed))


def singular_value(course: Course, tool: Tool, distances: Array, angles_deg: Array) -> Array:
    """Distance of postures (N, J) from singular ones: the least relevant singular value of the Jacobian, (N,)."""
    position, rotation = course.path.poses(distances)
    slope = np.degrees(_gap(course, tool, position, rotation, angles_deg)[1])
    values = np.linalg.svd(slope, compute_uv=False)
    return np.asarray(values[:, min(_rank(course.fixed), values.shape[1]) - 1])


def _check_range(course: Course, distance: float, angles_deg: Array) -> None:
    for joint, angle in zip(course.arm.driven, angles_deg, strict=True):
        low, high = joint.range_deg
        if not low - 1e-6 <= angle <= high + 1e-6:
            end = low if angle < low else high
            raise PlanError(
                f"{course.place(distance)}: {joint.name} reaches the end of its range, {end:g} {joint.unit.word}, so "
                "the tool cannot follow",
                f"move the line, or give {course.arm.texts.list_key('posture_deg')} of another branch at its start",
            )


def _stuck(course: Course, tool: Tool, distance: float, angles_deg: Array) -> PlanError:
    """The error: why the joints cannot follow from here on."""
    place = course.place(distance)
    if tool.turns.shape[1] < _rank(course.fixed):
        count = tool.turns.shape[1]
        return PlanError(
            f"{place}: {count} joints with a motor cannot keep the tool's orientation on the way as well",
            "ask for less of the orientation at its end: approach, or position_mm alone",
        )
    least = float(singular_value(course, tool, np.array([distance]), angles_deg[None])[0])
    if least < _SINGULAR:
        return PlanError(
            f"{place}: the arm comes to a singular posture{_which(course.arm, angles_deg)}, where its joints cannot "
            "follow the tool",
            "move the line away from it, turn the tool differently, or leave line out between these via points",
        )
    return PlanError(f"{place}: the arm reaches no further", "move the line nearer to the arm")


def passed(found: Followed) -> list[str]:
    """Notes: where the arm changes its branch on the way, or comes near to a singular posture."""
    course, words = found.course, []
    geometry = Geometry.of(course.arm)
    if not refusals(geometry):
        postures = np.radians(all_angles_deg(course.arm, found.angles_deg))
        before = branch_of(geometry, postures[0])
        for distance, posture in zip(found.distances[1:], postures[1:], strict=True):
            here = branch_of(geometry, posture).after(before)
            if parts := before.differs(here):
                words.append(
                    f"{course.place(float(distance))}: the arm changes its branch ({', '.join(parts)}), from "
                    f"{before} to {here}, through a singular posture"
                )
            before = here
    if not _is_loose(course, found.tool):
        values = singular_value(course, found.tool, found.distances, found.angles_deg)
        least = int(np.argmin(values))
        if values[least] < _SINGULAR and not words:
            posture = found.angles_deg[least]
            words.append(
                f"{course.place(float(found.distances[least]))}: the arm comes near to a singular posture"
                f"{_which(course.arm, posture)}, so its joints turn far there"
            )
    return words


def _which(arm: Arm, angles_deg: Array) -> str:
    """Describe the singular part of the arm, for arms with a closed form."""
    straight = straight_parts(arm, angles_deg)
    return f" ({', '.join(straight)})" if straight else ""


def straight_parts(arm: Arm, angles_deg: Array) -> list[str]:
    """Those of base, elbow and wrist that are about to change their branch; empty without a closed form."""
    geometry = Geometry.of(arm)
    if refusals(geometry):
        return []
    here = np.radians(all_angles_deg(arm, angles_deg))
    words = {"base": "wrist over the base", "elbow": "elbow straight", "wrist": "wrist straight"}
    found = set()
    for joint in range(len(here)):
        for shift in (-_STRAIGHT, _STRAIGHT):
            turned = here.copy()
            turned[joint] += shift
            found |= set(branch_of(geometry, here).differs(branch_of(geometry, turned)))
    return [words[part] for part in words if part in found]
