"""Forward kinematics: from joint angles to the tool's pose and to all frames."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Generic, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from armtempo.basics.arrays import Array
from armtempo.kinematics.geometry import Geometry, Link, T

Triple = tuple[T, T, T]


class Frame(NamedTuple, Generic[T]):
    """A coordinate frame in the base frame: three axes and the origin; elements are floats or arrays (N...)."""

    x: Triple[T]
    y: Triple[T]
    z: Triple[T]
    origin: Triple[T]


def forward(geometry: Geometry, angles_rad: ArrayLike) -> Array:
    """Return the tool's pose, Eq. (1): shape (..., 4, 4) for angles of shape (..., joints), in rad."""
    angles = np.asarray(angles_rad, dtype=np.float64)
    pose = np.zeros((*angles.shape[:-1], 4, 4))
    pose[..., 3, 3] = 1.0
    one = angles.ndim == 1
    tool: Frame[Any] = (frames(geometry, angles.tolist()) if one else array_frames(geometry, angles))[-1]
    for column, axis in enumerate(tool):
        for row, element in enumerate(axis):
            pose[..., row, column] = element
    return pose


def all_frames(geometry: Geometry, angles_rad: Sequence[float]) -> Array:
    """Return the poses of the base frame and of the frame after each joint, (joints + 1, 4, 4); the last: tool."""
    poses = np.tile(np.eye(4), (geometry.joints + 1, 1, 1))
    poses[:, :3] = np.swapaxes(np.array(frames(geometry, angles_rad)), 1, 2)
    return poses


def postures(geometry: Geometry, angles_rad: ArrayLike) -> Array:
    """Return the origins of the base and of every frame: shape (..., joints + 1, 3), for drawing the arm."""
    found = array_frames(geometry, np.asarray(angles_rad, dtype=np.float64))
    return np.stack([np.stack(frame.origin, axis=-1) for frame in found], axis=-2)


def frames(geometry: Geometry, angles_rad: Sequence[float]) -> list[Frame[float]]:
    """The base frame and the frame after each joint, with floats: for one posture, ten times as fast as with
    arrays."""
    moved = geometry.turns(angles_rad)
    depths = geometry.depths(moved)
    turns = [angle + link.offset for angle, link in zip(moved, geometry.links, strict=True)]
    for row, _ in geometry.slides:
        turns[row] = geometry.offset[row]
    return _chain(
        geometry, depths, [math.cos(turn) for turn in turns], [math.sin(turn) for turn in turns], 0.0, 1.0
    )


def array_frames(geometry: Geometry, angles_rad: Array) -> list[Frame[Array]]:
    """As ``frames``, with arrays, for angles of shape (..., joints)."""
    columns = np.stack(geometry.turns(list(np.moveaxis(angles_rad, -1, 0))))
    depths = geometry.depths(list(columns))
    turns = [column + link.offset for column, link in zip(columns, geometry.links, strict=True)]
    zero = np.zeros(angles_rad.shape[:-1])
    for row, _ in geometry.slides:
        turns[row] = zero + geometry.offset[row]
    return _chain(
        geometry, depths, [np.cos(turn) for turn in turns], [np.sin(turn) for turn in turns], zero, zero + 1.0
    )


def _chain(
    geometry: Geometry, depths: Sequence[float | T], cosines: Sequence[T], sines: Sequence[T], zero: T, one: T
) -> list[Frame[T]]:
    base = Frame((one, zero, zero), (zero, one, zero), (zero, zero, one), (zero, zero, zero))
    found = [base]
    for link, d, cos, sin in zip(geometry.links, depths, cosines, sines, strict=True):
        found.append(_next(link, d, found[-1], cos, sin))
    if geometry.tool:
        found[-1] = _with_tool(found[-1], geometry.tool)
    return found


def _with_tool(frame: Frame[T], tool: tuple[float, ...]) -> Frame[T]:
    """The frame of a tool on ``frame``; ``tool``: its pose there, 3 rows of 4."""
    columns = [(tool[column], tool[4 + column], tool[8 + column]) for column in range(4)]
    x, y, z, offset = (
        tuple(
            a * along + b * across + c * up
            for along, across, up in zip(frame.x, frame.y, frame.z, strict=True)
        )
        for a, b, c in columns
    )
    origin = tuple(here + away for here, away in zip(frame.origin, offset, strict=True))
    return Frame(x, y, z, origin)  # type: ignore[arg-type]


def _next(link: Link, d: float | T, frame: Frame[T], cos: T, sin: T) -> Frame[T]:
    """The frame after a joint: Rz(angle + offset) Tz(d) Tx(a) Rx(alpha), element by element."""
    _, a, cos_alpha, sin_alpha, _ = link
    (x0, x1, x2), (y0, y1, y2), (z0, z1, z2), (p0, p1, p2) = frame
    level0, level1, level2 = cos * y0 - sin * x0, cos * y1 - sin * x1, cos * y2 - sin * x2
    x0, x1, x2 = cos * x0 + sin * y0, cos * x1 + sin * y1, cos * x2 + sin * y2
    return Frame(
        (x0, x1, x2),
        (
            cos_alpha * level0 + sin_alpha * z0,
            cos_alpha * level1 + sin_alpha * z1,
            cos_alpha * level2 + sin_alpha * z2,
        ),
        (
            cos_alpha * z0 - sin_alpha * level0,
            cos_alpha * z1 - sin_alpha * level1,
            cos_alpha * z2 - sin_alpha * level2,
        ),
        (p0 + d * z0 + a * x0, p1 + d * z1 + a * x1, p2 + d * z2 + a * x2),
    )
