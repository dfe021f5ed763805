"""Constant rows at base and tool: removed from a pose for the closed form, and added to its angles."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.kinematics.forward import frames
from armtempo.kinematics.geometry import Geometry


def folded(geometry: Geometry, poses: Array) -> Array:
    """Poses (..., 4, 4) relative to the joints of ``geometry.core``."""
    base, tool = _still(geometry)
    return np.asarray(base @ poses @ tool)


def unfolded(geometry: Geometry, angles_rad: Array) -> Array:
    """Angles of all joints (..., joints) from those of the core (..., 6)."""
    angles = np.empty((*angles_rad.shape[:-1], geometry.joints))
    angles[...] = spread(geometry, [0.0] * (geometry.core.stop - geometry.core.start))
    angles[..., geometry.core] = angles_rad
    return angles


def spread(geometry: Geometry, angles_rad: Sequence[float]) -> tuple[float, ...]:
    """As ``unfolded``, for one posture with plain numbers."""
    still = dict(geometry.still)
    before = [still[index] for index in range(geometry.core.start)]
    return (*before, *angles_rad, *(still[index] for index in range(geometry.core.stop, geometry.joints)))


@lru_cache(maxsize=64)
def _still(geometry: Geometry) -> tuple[Array, Array]:
    """Inverse transforms of the rows before the core and after it."""
    core = geometry.core
    inverses = []
    for rows in (slice(0, core.start), slice(core.stop, geometry.joints)):
        d, a, alpha, offset = (row[rows] for row in (geometry.d, geometry.a, geometry.alpha, geometry.offset))
        angles = [angle for index, angle in geometry.still if index in range(geometry.joints)[rows]]
        frame = frames(Geometry(d, a, alpha, offset), angles)[-1]
        pose = np.eye(4)
        pose[:3] = np.column_stack(frame)
        inverse = np.eye(4)
        inverse[:3, :3] = pose[:3, :3].T
        inverse[:3, 3] = -pose[:3, :3].T @ pose[:3, 3]
        inverses.append(inverse)
    return inverses[0], inverses[1]
