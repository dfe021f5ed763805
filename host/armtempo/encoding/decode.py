"""From a motion record to a trajectory in degrees and seconds; the inverse of ``encode``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from armtempo_shared import limits
from armtempo_shared.motion import Motion, MotionError

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.splines.trajectory import JointSpline, Trajectory


class StepScale(Protocol):
    """An object with a joint's step pulses per degree."""

    @property
    def steps_per_deg(self) -> float:
        """Step pulses per degree of the joint."""


def trajectory(data: bytes, joints: Sequence[StepScale], name: str, arm: str = "the arm") -> Trajectory:
    """The motion in a record, to the rounding of its integers; ``joints``: the driven ones.

    ``name`` and ``arm`` are used in messages. Raises InputError if the record is damaged or has another number of
    joints.
    """
    try:
        motion = Motion(data)
    except MotionError as error:
        raise InputError(f"motion {name!r}: not a motion record ({error})", "upload it again") from error
    if motion.joints != len(joints):
        raise InputError(
            f"motion {name!r} has {motion.joints} joints, {arm} drives {len(joints)}",
            "connect the board that it was made for, or upload it again",
        )
    splines = []
    for index, joint in enumerate(joints):
        angles = _points(data, motion.angle_offset(index), motion.segments + motion.degree)
        times = _points(data, motion.time_offset(index), motion.segments * motion.refine + motion.degree)
        splines.append(
            JointSpline(
                motion.degree,
                motion.refine,
                angles / 2.0**limits.STEP_FRACTION_BITS / joint.steps_per_deg,
                times / 2.0**limits.TICK_FRACTION_BITS / limits.TICK_HZ,
            )
        )
    return Trajectory(name, tuple(splines), motion.shared)


def _points(data: bytes, offset: int, count: int) -> Array:
    return np.frombuffer(data, "<i8", count, offset).astype(float)
