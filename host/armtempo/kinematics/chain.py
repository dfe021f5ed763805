"""From the driven joints to the whole arm: angles of all joints, positions of links and tool."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.kinematics.forward import array_frames, postures
from armtempo.kinematics.geometry import Geometry
from armtempo.model.arm import Arm
from armtempo.splines.trajectory import Trajectory


def all_angles_deg(arm: Arm, driven_deg: Array) -> Array:
    """Angles of all joints (..., joints) from those of the driven ones (..., J); the others are at home."""
    angles = np.broadcast_to(arm.all_home_deg, (*driven_deg.shape[:-1], len(arm.joints))).copy()
    angles[..., list(arm.driven_indices)] = driven_deg
    return angles


def spread_deg(arm: Arm, angles_deg: ArrayLike, what: str = "") -> Array:
    """Angles of all joints (..., joints) from angles of all or of the driven joints (..., J); the others are at home.

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
        f"{what}{count} {arm.texts.position}s given, but arm {arm.name!r} has {len(arm.joints)} joints{driven}",
        f"give one {arm.texts.position} for each",
    )


def chains_mm(arm: Arm, driven_deg: Array) -> Array:
    """Origins of the base and all joint frames, (..., joints + 1, 3), for driven angles (..., J)."""
    return postures(Geometry.of(arm), np.radians(all_angles_deg(arm, driven_deg)))


def outline_mm(arm: Arm, angles_deg: Array) -> Array:
    """The arm without a tool as a line through its frames, along each d and then along each a: (..., 2 joints + 1, 3).

    For angles of all joints, (..., joints).
    """
    geometry = Geometry.of(arm).bare
    angles = np.radians(angles_deg)
    found = array_frames(geometry, angles)
    points = [np.stack(found[0].origin, axis=-1)]
    depths = geometry.depths(list(np.moveaxis(angles, -1, 0)))  # a linkage turns no sliding row
    for d, before, after in zip(depths, found, found[1:], strict=False):
        points.append(points[-1] + np.asarray(d)[..., None] * np.stack(before.z, axis=-1))
        points.append(np.stack(after.origin, axis=-1))
    return np.stack(points, axis=-2)


def tool_path_mm(arm: Arm, trajectory: Trajectory, times_s: Array) -> Array:
    """Tool positions (K, 3) at the given times (K,)."""
    return chains_mm(arm, trajectory(times_s))[:, -1]
