"""From a motion record back to a trajectory in degrees and seconds: the opposite of ``encode``."""

from __future__ import annotations

import numpy as np
from armtempo_shared import limits
from armtempo_shared.motion import Motion, MotionError

from armtempo.errors import InputError
from armtempo.model.arm import Arm
from armtempo.records.encode import steps_per_deg
from armtempo.splines.bspline import Array
from armtempo.splines.trajectory import JointSpline, Trajectory


def trajectory(data: bytes, arm: Arm, name: str) -> Trajectory:
    """The motion that a record holds, to the rounding of its integers.

    Raises InputError where the record is damaged or has another number of joints than the arm drives.
    """
    try:
        motion = Motion(data)
    except MotionError as error:
        raise InputError(f"motion {name!r}: not a motion record ({error}); upload it again") from error
    if motion.joints != len(arm.driven):
        raise InputError(
            f"motion {name!r} has {motion.joints} joints, arm {arm.name!r} drives {len(arm.driven)}"
        )
    joints = []
    for index, joint in enumerate(arm.driven):
        angles = _points(data, motion.angle_offset(index), motion.segments + motion.degree)
        times = _points(data, motion.time_offset(index), motion.segments * motion.refine + motion.degree)
        joints.append(
            JointSpline(
                motion.degree,
                motion.refine,
                angles / 2.0**limits.STEP_FRACTION_BITS / steps_per_deg(joint),
                times / 2.0**limits.TICK_FRACTION_BITS / limits.TICK_HZ,
            )
        )
    return Trajectory(name, tuple(joints), motion.shared)


def _points(data: bytes, offset: int, count: int) -> Array:
    return np.frombuffer(data, "<i8", count, offset).astype(float)
