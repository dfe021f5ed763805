"""A jog of one joint, or of the tool along or about an axis, from the present posture."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError, PlanError
from armtempo.kinematics.chain import all_angles_deg
from armtempo.kinematics.forward import forward
from armtempo.kinematics.geometry import Geometry
from armtempo.model.arm import Arm
from armtempo.model.parts import END_STEPS, DrivenJoint
from armtempo.planning import brake_time, move_law, point_to_point, workspace_check
from armtempo.planning.brake_time import BrakeTimes
from armtempo.planning.move_law import DEGREE, MoveLimits
from armtempo.splines import bspline, extremes
from armtempo.splines.trajectory import Trajectory

if TYPE_CHECKING:
    from armtempo.planning.jog.jog_line import FollowedLine, ToolLine

SPEED = 0.25
"""Default speed, as a fraction of the arm's speed limits."""
SLOWEST = 0.01
LINE_PARTS = (8, 16, 32, 64)
"""Numbers of parts of a line, increased until the tool stays on it."""
_SHORTER = 0.98
_TRIES = 6
_INSIDE_STEPS = 1e-6
_SHORTENED, _NEARER = 8, 0.9
"""A jog that would leave the workspace is shortened up to this often, each time to this fraction of the distance to the
touch."""


@dataclass(frozen=True)
class JogMove:
    """The joint or axis to move, and the distance."""

    by: float
    """deg or mm; infinite: as far as possible."""
    joint: int | None = None
    """Index among the driven joints, from 0."""
    axis: str = ""
    """As ``jog_line.direction_of`` takes it, if it is not a joint."""
    about: bool = False
    """Turn the tool about the axis instead of moving it along."""

    def unit(self, arm: Arm) -> str:
        """Unit of ``by``."""
        if self.joint is not None:
            return arm.driven[self.joint].unit.name
        return "deg" if self.about else "mm"

    def describe(self, arm: Arm) -> str:
        """Describe what moves."""
        if self.joint is not None:
            return arm.driven[self.joint].name
        return f"tool {'about' if self.about else 'along'} {self.axis}"


@dataclass(frozen=True, eq=False)
class JogMotion:
    """A planned jog."""

    trajectory: Trajectory
    brakes: BrakeTimes
    """Its brake times."""
    ends: str
    """Why it ends early; "" if it does not."""

    @property
    def end_deg(self) -> Array:
        """End posture, degrees (J,)."""
        return self.trajectory(self.trajectory.duration_s)


def by_of_joint(arm: Arm, joint: int | str, by: float) -> tuple[float | None, float | None]:
    """``by_deg`` and ``by_mm`` of a jog of a joint by a distance in its unit; InputError if there is no such joint."""
    return (None, by) if arm.driven[number_of_joint(arm, joint)].slides else (by, None)


def move_of(
    arm: Arm, joint: int | str | None, axis: str | None, by_deg: float | None, by_mm: float | None
) -> JogMove:
    """A move from the arguments of ``Board.jog``: a joint by degrees (a sliding one by mm), or the tool along an axis
    by mm or about it by degrees.

    Raises InputError if the arguments contradict, or the arm has no such joint.
    """
    given = [by for by in (by_deg, by_mm) if by is not None]
    number = None if joint is None or len(given) != 1 else number_of_joint(arm, joint)
    slides = number is not None and arm.driven[number].slides
    if (
        (joint is None) == (axis is None)
        or len(given) != 1
        or (number is not None and not slides and by_deg is None)
    ):
        raise InputError(
            "a jog moves a joint by degrees, or the tool along an axis by mm or about it by degrees",
            "give joint and by_deg, axis and by_mm, or axis and by_deg",
        )
    if number is not None:
        if slides and by_mm is None:
            raise InputError(
                f"{arm.driven[number].name} slides: it moves by mm, not by degrees", "give by_mm"
            )
        return JogMove(given[0], joint=number)
    return JogMove(given[0], axis=axis or "", about=by_deg is not None)


def plan(name: str, arm: Arm, here_deg: Sequence[float], move: JogMove, speed: float = SPEED) -> JogMotion:
    """The jog from rest at ``here_deg`` (J,), at the fraction ``speed`` of the arm's speed limits.

    It ends early at the end of a range, before it would leave the arm's workspace, and, for a line of the tool,
    where the arm cannot follow. Raises InputError for a move that is none, or if it can go nowhere.
    """
    start = np.array(here_deg, dtype=float)
    if not SLOWEST <= speed <= 1.0:
        raise InputError(
            f"a speed of {speed:g} is not allowed", f"give a part of the limits, {SLOWEST:g} to 1"
        )
    if math.isnan(move.by) or move.by == 0.0:
        raise InputError("a jog by 0 moves nothing", "give a distance in degrees or mm")
    if (move.joint is None) == (not move.axis):
        raise InputError("a jog moves either a joint or the tool", "name a joint, or an axis")
    trajectory, ends = _in_workspace(name, arm, start, move, speed)
    limits = [joint.limits for joint in arm.driven]
    return JogMotion(trajectory, brake_time.of_motion(trajectory, limits), ends)


def problem(arm: Arm, here_deg: Sequence[float], move: JogMove) -> str:
    """Why a jog cannot begin at ``here_deg`` (J,), without a check of the workspace; "" if it can."""
    start = np.array(here_deg, dtype=float)
    try:
        if move.joint is not None:
            _end_deg(arm.driven[move.joint], start[move.joint], move.by)
        else:
            _ = _line(arm, start, move).fixed
    except InputError as error:
        return str(error)
    return ""


def _in_workspace(name: str, arm: Arm, start: Array, move: JogMove, speed: float) -> tuple[Trajectory, str]:
    """The jog, shortened to stay in the workspace, and why it ends early."""
    why = ""
    for _ in range(_SHORTENED):
        planned = _joint if move.joint is not None else _tool
        trajectory, ends = planned(name, arm, start, move, speed)
        touch = workspace_check.touch_of(arm, trajectory, outwards=True)
        if touch is None:
            workspace_check.tell_start(arm, start)
            return trajectory, why or ends
        why = f"{touch.link} would touch {touch.other}"
        part = _NEARER * _passed(arm, trajectory, touch.time_s, move)
        if part <= 0.0:
            break
        move = replace(move, by=math.copysign(part, move.by))
    raise InputError(f"the arm cannot jog that way: {why}", "jog it the other way, or another joint")


def _passed(arm: Arm, trajectory: Trajectory, time_s: float, move: JogMove) -> float:
    """The distance of a jog at a time, in its unit."""
    first, there = trajectory(np.array([0.0, time_s]))
    if move.joint is not None:
        return float(abs(there[move.joint] - first[move.joint]))
    poses = forward(Geometry.of(arm), np.radians(all_angles_deg(arm, np.stack([first, there]))))
    if not move.about:
        return float(np.linalg.norm(poses[1, :3, 3] - poses[0, :3, 3]))
    cosine = 0.5 * (np.trace(poses[0, :3, :3].T @ poses[1, :3, :3]) - 1.0)
    return math.degrees(math.acos(min(1.0, max(-1.0, cosine))))


def number_of_joint(arm: Arm, joint: int | str) -> int:
    """The index of a joint, from 0, by its number (from 1) or its name; raises InputError if there is none."""
    names = [driven.name for driven in arm.driven]
    if joint in names:
        return names.index(str(joint))
    if str(joint).isdecimal() and 1 <= int(joint) <= len(names):
        return int(joint) - 1
    raise InputError(
        f"arm {arm.name!r} drives no joint {joint!r}",
        f"give 1 to {len(names)}, or a name: {', '.join(names)}",
    )


def _joint(name: str, arm: Arm, start: Array, move: JogMove, speed: float) -> tuple[Trajectory, str]:
    assert move.joint is not None
    joint = arm.driven[move.joint]
    end, ends = _end_deg(joint, start[move.joint], move.by)
    there = start.copy()
    there[move.joint] = end
    begin = start + point_to_point.ahead(start, there, arm) * (there - start)
    found = move_law.law(abs(end - begin[move.joint]), move_law.of_joints([joint.limits], [1.0], speed))
    turned = math.copysign(1.0, end - start[move.joint]) * found.distance
    rows = [
        begin[index] + (turned if index == move.joint else np.zeros_like(turned))
        for index in range(len(arm.driven))
    ]
    return found.trajectory(name, rows), ends


def _end_deg(joint: DrivenJoint, here: float, by: float) -> tuple[float, str]:
    """The end of a joint's jog, degrees (a whole step, if its travel ends it), and why it ends there.

    InputError if it cannot move that way.
    """
    low, high = joint.travel_deg
    wanted = here + by
    if (low - wanted) * joint.steps_per_deg <= END_STEPS >= (wanted - high) * joint.steps_per_deg:
        return min(max(wanted, low), high), ""
    at_end = f"{joint.name} is at {joint.end_of_travel('high' if by > 0 else 'low')}"
    edge = min(high, wanted) if by > 0 else max(low, wanted)
    scale = joint.steps_per_deg
    inside = math.floor(edge * scale + 1e-9) / scale if by > 0 else math.ceil(edge * scale - 1e-9) / scale
    end = max(inside, here) if by > 0 else min(inside, here)
    if abs(end - here) * scale < _INSIDE_STEPS:
        raise InputError(f"{at_end}, {end:g} {joint.unit.word}", "jog it the other way")
    return end, f"{at_end}, {edge:g} {joint.unit.word}"


def _tool(name: str, arm: Arm, start: Array, move: JogMove, speed: float) -> tuple[Trajectory, str]:
    line = _line(arm, start, move)
    longest = 360.0 if move.about else 2.0 * line.reach_mm
    followed = line.followed(min(abs(move.by), longest))
    ends = followed.ends
    if followed.length < 1e-6:
        raise InputError(f"the tool cannot move on: {ends}", "jog the other way, or single joints")
    length = followed.length
    for _ in range(_TRIES):
        trajectory = _on_line(name, followed, length, speed)
        if trajectory is not None:
            return trajectory, ends
        length *= _SHORTER
        ends = ends or "the joints cannot follow the line any further"
    raise PlanError("the tool cannot follow this line", "jog single joints")


def _line(arm: Arm, start: Array, move: JogMove) -> ToolLine:
    """The line of the tool; InputError if there is no such axis, or the arm cannot be at ``start``."""
    from armtempo.planning.jog.jog_line import (  # here, because joints need no kinematics
        ToolLine,
        direction_of,
    )

    direction_of(arm, move.axis, np.eye(4))  # raises InputError for an axis that there is not
    point_to_point.posture(start, arm)
    return ToolLine(arm, start, move.axis, move.about, 1 if move.by > 0 else -1)


def _on_line(name: str, followed: FollowedLine, length: float, speed: float) -> Trajectory | None:
    """The motion along the line; None if a joint would leave its range, or the tool the line."""
    arm = followed.line.arm
    limits = _line_limits(followed, length, speed)
    begin = _line_begin(followed, length)
    for parts in LINE_PARTS:
        law = move_law.law(length - begin, limits, length / parts)
        angles = followed.at(np.clip(begin + law.at_knots, begin, length))
        points = bspline.fit(angles, DEGREE)
        trajectory = law.trajectory(name, list(points.T))
        if not _within(trajectory, arm):
            return None
        if followed.is_kept(points, begin + law.distance):
            return _slowed(trajectory, arm, speed)
    return None


def _line_begin(followed: FollowedLine, length: float) -> float:
    """Where on the line the motion begins: ahead of where the motors stand (``point_to_point.ahead``)."""
    arm = followed.line.arm
    first, second = np.degrees(followed.angles_rad[:2][:, list(arm.driven_indices)])
    there = first + (second - first) * (length / float(followed.distances[1]))
    begin = length * point_to_point.ahead(first, there, arm)
    off = arm.transmission.steps(followed.at(np.array([begin]))[0]) - np.rint(arm.transmission.steps(first))
    return begin if np.all(np.abs(off) <= 0.5) else 0.0


def _line_limits(followed: FollowedLine, length: float, speed: float) -> MoveLimits:
    """Limits of the distance along the line, from those of the joints."""
    arm = followed.line.arm
    upto = followed.distances <= length * (1 + 1e-9)
    angles = np.degrees(followed.angles_rad[upto][:, list(arm.driven_indices)])
    distances = followed.distances[upto]
    if len(distances) < 2:
        angles, distances = (
            np.degrees(followed.angles_rad[:2][:, list(arm.driven_indices)]),
            followed.distances[:2],
        )
    gains = np.abs(np.diff(angles, axis=0) / np.diff(distances)[:, None]).max(axis=0) + 1e-12
    return move_law.of_joints([joint.limits for joint in arm.driven], gains.tolist(), speed)


def _within(trajectory: Trajectory, arm: Arm) -> bool:
    powers = np.vander(np.linspace(0.0, 1.0, 9), DEGREE + 1, increasing=True).T
    angles = np.stack([(joint.angle_polynomials @ powers).ravel() for joint in trajectory.joints], axis=1)
    low, high = np.array([joint.travel_deg for joint in arm.driven]).T
    low, high = np.minimum(low, angles[0]), np.maximum(high, angles[0])  # a whole step may lie just beyond
    return bool(np.all(angles >= low - 1e-9) and np.all(angles <= high + 1e-9))


def _slowed(trajectory: Trajectory, arm: Arm, speed: float) -> Trajectory:
    """The motion scaled so that every joint keeps its fraction of the limits."""
    factor = 0.0
    for reached, joint in zip(extremes.of_joints(trajectory.joints), arm.driven, strict=True):
        most = joint.limits
        factor = max(
            factor,
            reached.speed_deg_s / (speed * most.speed_deg_s),
            math.sqrt(reached.acceleration_deg_s2 / (move_law.ACCELERATION * most.acceleration_deg_s2)),
            math.cbrt(reached.jerk_deg_s3 / (move_law.JERK * most.jerk_deg_s3)),
        )
    joints = tuple(replace(joint, time_points_s=factor * joint.time_points_s) for joint in trajectory.joints)
    return Trajectory(trajectory.name, joints, shared=True)
