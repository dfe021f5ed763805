"""Motions without a search: from posture to posture, and a motion backwards."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from armtempo.basics.errors import InputError, PlanError
from armtempo.model.arm import Arm
from armtempo.planning import move_law
from armtempo.splines.bspline import Array
from armtempo.splines.trajectory import JointSpline, Trajectory

_LEAST_DEG, _LEAST_GAIN = 1e-9, 1e-9
AHEAD_STEPS = 0.5 - 1.0 / 128.0
"""By how much of a step a move by hand begins ahead of where its motors stand. A step comes where the position passes
half a step, so that the first one comes after a quarter of the time: the distance rises with the third power of that.
The board takes starts up to half a step away."""
_OFF_STEPS = 0.25
"""A posture that is further from whole steps may have been rounded by the board to other ones."""


def straight(name: str, start_deg: ArrayLike, end_deg: ArrayLike, arm: Arm, speed: float = 1.0) -> Trajectory:
    """The motion from rest at ``start_deg`` (J,) to rest at ``end_deg`` (J,), all joints together.

    At the fraction ``speed`` of the arm's speed, by the law of moves by hand. Raises InputError if a posture has
    another number of joints than the arm drives or leaves a joint's range.
    """
    start, end = posture(start_deg, arm), posture(end_deg, arm)
    distances = np.abs(end - start)
    longest = max(float(distances.max()), _LEAST_DEG)
    gains = np.maximum(distances / longest, _LEAST_GAIN).tolist()
    limits = move_law.of_joints([joint.limits for joint in arm.driven], gains, speed)
    law = move_law.law(longest, limits)
    return law.trajectory(
        name, [here + (to - here) / longest * law.distance for here, to in zip(start, end, strict=True)]
    )


def check_switches(start_deg: ArrayLike, end_deg: ArrayLike, arm: Arm) -> None:
    """Raise PlanError if a joint on its way between two postures (J,) runs into a switch within its range."""
    for joint, start, end in zip(arm.driven, np.asarray(start_deg), np.asarray(end_deg), strict=True):
        low, high = joint.travel_deg
        if end < min(low, start) or end > max(high, start):
            side, at_deg = ("low", low) if end < low else ("high", high)
            raise PlanError(
                f"{joint.name} would go to {end:g} {joint.unit.word}, beyond its {side} switch, which stops it at "
                f"{at_deg:g}",
                f"stay on this side of it, or correct {joint.unit.key(f'{side}_deg')} in its [switches]",
            )


def ahead(start_deg: Array, end_deg: Array, arm: Arm) -> float:
    """The part of the move from one posture (J,), at which the motors stand, to another that a move begins ahead.

    No motor is then further than AHEAD_STEPS from where it stands; 0 for a move of a step or less.
    """
    here, there = arm.transmission.steps([start_deg, end_deg])
    distances = there - here
    off = here - np.rint(here)
    moving = distances != 0.0
    if not np.any(np.abs(distances) > 1.0) or np.any(np.abs(off) > _OFF_STEPS):
        return 0.0
    return float(np.min((AHEAD_STEPS - np.sign(distances) * off)[moving] / np.abs(distances)[moving]))


def backwards(trajectory: Trajectory, name: str) -> Trajectory:
    """The reversed motion; every joint starts at time 0."""
    return Trajectory(name, tuple(_backwards(joint) for joint in trajectory.joints), trajectory.shared)


def posture(angles_deg: ArrayLike, arm: Arm) -> Array:
    """The angles as an array (J,); raises InputError if their number or a range does not fit the arm."""
    try:
        found = np.asarray(angles_deg, dtype=float)
    except (TypeError, ValueError):
        raise InputError(
            f"{angles_deg!r:.40} is not a posture",
            f"give an angle in degrees for each joint with a motor{', of a sliding one mm' if arm.slides else ''}",
        ) from None
    if found.shape != (len(arm.driven),):
        raise InputError(
            f"a posture of arm {arm.name!r} has {len(arm.driven)} {arm.texts.position}s, not {found.size}",
            "give one for each joint with a motor",
        )
    found = np.array(arm.placed(found))
    for joint, angle in zip(arm.driven, found, strict=True):
        if problem := joint.range_problem(angle):
            raise InputError(problem, "stay within it")
    return found


def _backwards(joint: JointSpline) -> JointSpline:
    segments = len(joint.angle_points_deg) - joint.degree
    return JointSpline(
        joint.degree,
        joint.refine,
        joint.angle_points_deg[::-1].copy(),
        joint.duration_s - joint.time_points_s[::-1],
        None if joint.via_segments is None else tuple(segments - via for via in reversed(joint.via_segments)),
    )
