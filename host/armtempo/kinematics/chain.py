"""From the driven joints to the whole arm: angles of all joints, and where they bring its links and its tool."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from armtempo.arrays import Array
from armtempo.errors import InputError
from armtempo.kinematics.forward import postures
from armtempo.kinematics.geometry import Geometry
from armtempo.model.arm import Arm
from armtempo.splines.trajectory import Trajectory


def all_angles_deg(arm: Arm, driven_deg: Array) -> Array:
    """Angles of all joints (..., joints) from those of the driven ones (..., J); the others stand at home."""
    angles = np.broadcast_to(
        [joint.home_deg for joint in arm.joints], (*driven_deg.shape[:-1], len(arm.joints))
    )
    angles = angles.copy()
    angles[..., [joint.motor is not None for joint in arm.joints]] = driven_deg
    return angles


def spread_deg(arm: Arm, angles_deg: ArrayLike, what: str = "") -> Array:
    """Angles of all joints (..., joints) from theirs or from those of the driven ones (..., J), the others at home.

    Raises InputError, which begins with ``what``, for another number of angles.
    """
    angles = np.asarray(angles_deg, dtype=np.float64)
    count = angles.shape[-1] if angles.ndim else 1
    if angles.ndim and count == len(arm.joints):
        return angles
    if angles.ndim and count == len(arm.driven):
        return all_angles_deg(arm, angles)
    driven = "" if len(arm.driven) == len(arm.joints) else f", of which {len(arm.driven)} have a motor"
    raise InputError(
        f"{what}{count} angles given, but arm {arm.name!r} has {len(arm.joints)} joints{driven}; give one angle "
        "for each"
    )


def chains_mm(arm: Arm, driven_deg: Array) -> Array:
    """Origins of the base and all joint frames, (..., joints + 1, 3), for driven angles (..., J)."""
    return postures(Geometry.of(arm), np.radians(all_angles_deg(arm, driven_deg)))


def tool_path_mm(arm: Arm, trajectory: Trajectory, times_s: Array) -> Array:
    """Tool positions (K, 3) at the given times (K,)."""
    return chains_mm(arm, trajectory(times_s))[:, -1]
