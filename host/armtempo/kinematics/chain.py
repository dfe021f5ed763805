"""Where the whole arm is while its driven joints move: postures and tool path for the drawings."""

from __future__ import annotations

import numpy as np

from armtempo.kinematics.forward import postures
from armtempo.kinematics.geometry import Array, Geometry
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


def chains_mm(arm: Arm, driven_deg: Array) -> Array:
    """Origins of the base and all joint frames, (..., joints + 1, 3), for driven angles (..., J)."""
    return postures(Geometry.of(arm), np.radians(all_angles_deg(arm, driven_deg)))


def tool_path_mm(arm: Arm, trajectory: Trajectory, times_s: Array) -> Array:
    """Tool positions (K, 3) at the given times (K,)."""
    return chains_mm(arm, trajectory(times_s))[:, -1]
