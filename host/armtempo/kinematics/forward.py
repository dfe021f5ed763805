"""Forward kinematics: from joint angles to the tool's pose and to the origins of all frames."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from armtempo.kinematics.geometry import Array, Geometry, twist


class Frame(NamedTuple):
    """A coordinate frame in the base frame: three axes and the origin, each of shape (3, ...)."""

    x: Array
    y: Array
    z: Array
    origin: Array


def frames(geometry: Geometry, angles_rad: ArrayLike) -> Iterator[Frame]:
    """Yield the base frame and the frame after each joint, for angles of shape (..., joints).

    One array a matrix element, no products of 4 x 4 matrices: many postures cost little more than one.
    """
    angles = geometry.turns(np.asarray(angles_rad, dtype=np.float64))
    batch = angles.shape[:-1]
    x, y, z = (np.broadcast_to(unit.reshape(3, *(1,) * len(batch)), (3, *batch)) for unit in np.eye(3))
    origin = np.zeros((3, *batch))
    yield Frame(x, y, z, origin)
    for i in range(geometry.joints):
        turn = angles[..., i] + geometry.offset[i]
        cos, sin = np.cos(turn), np.sin(turn)
        cos_alpha, sin_alpha = twist(geometry.alpha[i])
        x, level = cos * x + sin * y, cos * y - sin * x
        origin = origin + geometry.d[i] * z + geometry.a[i] * x
        y, z = cos_alpha * level + sin_alpha * z, cos_alpha * z - sin_alpha * level
        yield Frame(x, y, z, origin)


def forward(geometry: Geometry, angles_rad: ArrayLike) -> Array:
    """Return the tool's pose, Eq. (1): shape (..., 4, 4) for angles of shape (..., joints), in rad."""
    *_, tool = frames(geometry, angles_rad)
    pose = np.zeros((*tool.origin.shape[1:], 4, 4))
    for column, axis in enumerate(tool):
        pose[..., :3, column] = np.moveaxis(axis, 0, -1)
    pose[..., 3, 3] = 1.0
    return pose


def postures(geometry: Geometry, angles_rad: ArrayLike) -> Array:
    """Return the origins of the base and of every frame: shape (..., joints + 1, 3), for drawing the arm."""
    origins = [np.moveaxis(frame.origin, 0, -1) for frame in frames(geometry, angles_rad)]
    return np.stack(origins, axis=-2)
