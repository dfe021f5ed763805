"""From a motion record to a trajectory in degrees and seconds; the inverse of ``encode``."""

from __future__ import annotations

import numpy as np
from armtempo_shared import limits
from armtempo_shared.motion import Motion, MotionError

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.model.transmission import Transmission
from armtempo.splines.trajectory import JointSpline, Trajectory


def trajectory(data: bytes, gears: Transmission, name: str, arm: str = "the arm") -> Trajectory:
    """The motion in a record, to the rounding of its integers; ``gears``: of the arm that it was made for.

    ``name`` and ``arm`` are used in messages. Raises InputError if the record is damaged or has another number of
    joints.
    """
    try:
        motion = Motion(data)
    except MotionError as error:
        raise InputError(f"motion {name!r}: not a motion record ({error})", "upload it again") from error
    joints = len(gears.steps_per_deg)
    if motion.joints != joints:
        raise InputError(
            f"motion {name!r} has {motion.joints} joints, {arm} drives {joints}",
            "connect the board that it was made for, or upload it again",
        )
    if gears.coupling and not motion.shared:
        raise InputError(
            f"motion {name!r}: its joints have a time axis each, but {arm} has coupled joints",
            "upload it again",
        )
    steps = [
        _points(data, motion.angle_offset(index), motion.segments + motion.degree) for index in range(joints)
    ]
    angles = gears.angles_of_steps(np.stack(steps, axis=-1) / 2.0**limits.STEP_FRACTION_BITS)
    splines = []
    for index in range(joints):
        times = _points(data, motion.time_offset(index), motion.segments * motion.refine + motion.degree)
        splines.append(
            JointSpline(
                motion.degree,
                motion.refine,
                angles[:, index].copy(),
                times / 2.0**limits.TICK_FRACTION_BITS / limits.TICK_HZ,
            )
        )
    return Trajectory(name, tuple(splines), motion.shared)


def _points(data: bytes, offset: int, count: int) -> Array:
    return np.frombuffer(data, "<i8", count, offset).astype(float)
