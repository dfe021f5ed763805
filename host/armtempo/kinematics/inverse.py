"""The hybrid inverse of section 2.1: all eight solutions, for one pose or many at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armtempo.basics.arrays import Array
from armtempo.kinematics import formulas
from armtempo.kinematics.closed_form import (
    ArmPart,
    WristPart,
    duplicates,
    on_border,
    solve_arm,
    solve_wrist,
)
from armtempo.kinematics.formulas import ARRAYS
from armtempo.kinematics.forward import frames
from armtempo.kinematics.geometry import Geometry
from armtempo.kinematics.shape import Shape
from armtempo.kinematics.single import solve_pose
from armtempo.kinematics.solutions import (
    DUPLICATE,
    ELBOW_STRETCHED,
    IN_OFFSET,
    ON_AXIS_1,
    TOO_FAR,
    TOO_NEAR,
    WRIST_STRAIGHT,
    PoseSolutions,
    Solutions,
)

CHUNK = 8192
"""Poses per batch: enough to hide the cost of a call, few enough for the caches."""


def inverse(geometry: Geometry, poses: ArrayLike, previous_rad: ArrayLike | None = None) -> Solutions:
    """Return all solutions for ``poses``, shape (N, 4, 4) or (4, 4), lengths in the geometry's unit.

    ``previous_rad``, (joints,) or (N, joints), default zeros, determines the free angles of a singular pose.
    The rotation part must be a rotation, see ``pose.checked``. Raises InputError for an arm outside the
    class.
    """
    if geometry.moving is not geometry:
        own = None if previous_rad is None else np.asarray(previous_rad, dtype=float)[..., geometry.core]
        found = inverse(geometry.moving, folded(geometry, np.asarray(poses, dtype=np.float64)), own)
        return replace(found, angles_rad=unfolded(geometry, found.angles_rad))
    shape = Shape.of(geometry)
    matrices = np.asarray(poses, dtype=np.float64)
    previous = np.zeros(6) if previous_rad is None else np.asarray(previous_rad, dtype=np.float64)
    if matrices.shape == (4, 4) and previous.shape == (6,):
        return _of_one(inverse_of_pose(geometry, matrices.ravel().tolist(), previous.tolist()))
    matrices = matrices.reshape(-1, 16)
    previous = previous + np.array(shape.joint_offset)
    total = len(matrices)
    angles = np.empty((6, 2, 2, 2, total))
    outcome = np.zeros((2, 2, 2, total), dtype=np.uint8)
    singular = np.zeros((2, 2, 2, total), dtype=np.uint8)
    for start in range(0, total, CHUNK):
        part = slice(start, start + CHUNK)
        before = previous if previous.ndim == 1 else previous[part]
        arm, wrist = _solve(shape, matrices[part], before)
        _angles_into(angles[..., part], shape, arm, wrist)
        _outcome_into(outcome[..., part], shape, arm)
        _singular_into(singular[..., part], shape, arm, wrist)
    return Solutions(
        np.moveaxis(angles.reshape(6, 8, total), (0, 1, 2), (2, 1, 0)),
        outcome.reshape(8, total).T,
        singular.reshape(8, total).T,
    )


def inverse_of_pose(
    geometry: Geometry, pose: Sequence[float], previous_rad: Sequence[float] | None = None
) -> PoseSolutions:
    """Return all solutions for one pose with plain numbers, several times as fast as with arrays.

    ``pose``: its 12 or 16 elements in row order; ``previous_rad``: an angle for each joint. Otherwise as ``inverse``.
    """
    if geometry.moving is not geometry:
        rows = folded(geometry, np.append(pose[:12], (0.0, 0.0, 0.0, 1.0)).reshape(4, 4)).ravel().tolist()
        found = inverse_of_pose(geometry.moving, rows, previous_rad and previous_rad[geometry.core])
        return found._replace(angles_rad=[spread(geometry, angles) for angles in found.angles_rad])
    shape = Shape.of(geometry)
    previous_rad = (0.0,) * 6 if previous_rad is None else previous_rad
    previous = [angle + offset for angle, offset in zip(previous_rad, shape.joint_offset, strict=True)]
    return solve_pose(shape, pose, previous)


def _of_one(found: PoseSolutions) -> Solutions:
    return Solutions(
        np.array([found.angles_rad]),
        np.array([found.outcome], dtype=np.uint8),
        np.array([found.singular], dtype=np.uint8),
    )


def wrist_centre(shape: Shape, pose: Array) -> Array:
    """Eq. (2) for poses as (12 or 16, N) elements in row order: the wrist centre, (3, N)."""
    n, o, a, position = (pose[column:12:4] for column in range(4))
    return formulas.wrist_centre(shape, n, o, a, position)


def _solve(shape: Shape, matrices: Array, previous: Array) -> tuple[ArmPart, WristPart]:
    pose = np.ascontiguousarray(matrices.T)
    arm = solve_arm(shape, wrist_centre(shape, pose), previous)
    n, o, a = (pose[column:12:4] for column in range(3))
    axes = np.stack((n, *formulas.before_flange(shape, o, a)))
    return arm, solve_wrist(shape, arm, axes, previous[..., 3])


def _angles_into(out: Array, shape: Shape, arm: ArmPart, wrist: WristPart) -> None:
    """Write the six angles, offsets taken off and wrapped, for both wrists: out (6, 2, 2, 2, n)."""
    half_turn4 = np.copysign(np.pi, wrist.theta4)
    half_turn6 = np.copysign(np.pi, wrist.theta6)
    wide = (arm.theta1[:, None], arm.theta2, arm.theta3)
    for joint, theta in enumerate(wide):
        offset = shape.joint_offset[joint]
        turned = ARRAYS.wrapped(theta - offset) if offset or joint == 2 else theta
        out[joint] = turned[:, :, None]
    np.copyto(out[0], np.nan, where=np.isnan(out[1]))
    flipped = (wrist.theta4 - half_turn4, -wrist.theta5, wrist.theta6 - half_turn6)
    for joint, (plain, turned) in enumerate(zip(wrist[:3], flipped, strict=True), start=3):
        out[joint, :, :, 0], out[joint, :, :, 1] = plain, turned
        if shape.joint_offset[joint]:
            out[joint] = ARRAYS.wrapped(out[joint] - shape.joint_offset[joint])


def _outcome_into(out: NDArray[np.uint8], shape: Shape, arm: ArmPart) -> None:
    r = arm.radii.shoulder[:, None, None]
    out[duplicates(shape, arm.radii)[:, :, None].repeat(2, axis=2)] = DUPLICATE
    np.copyto(out, TOO_FAR, where=r > shape.farthest)
    np.copyto(out, TOO_NEAR, where=r < shape.nearest)
    np.copyto(out, IN_OFFSET, where=np.isnan(r))


def _singular_into(out: NDArray[np.uint8], shape: Shape, arm: ArmPart, wrist: WristPart) -> None:
    if not shape.offset:
        out |= arm.radii.axis * np.uint8(ON_AXIS_1)
    out |= (on_border(shape, arm.radii) * np.uint8(ELBOW_STRETCHED))[:, None, None]
    out |= (wrist.singular * np.uint8(WRIST_STRAIGHT))[:, :, None]


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
        tool = geometry.tool if rows.stop == geometry.joints else ()
        slides = tuple(
            (index - rows.start, far) for index, far in geometry.slides if rows.start <= index < rows.stop
        )
        frame = frames(Geometry(d, a, alpha, offset, tool=tool, slides=slides), angles)[-1]
        pose = np.eye(4)
        pose[:3] = np.column_stack(frame)
        inverse = np.eye(4)
        inverse[:3, :3] = pose[:3, :3].T
        inverse[:3, 3] = -pose[:3, :3].T @ pose[:3, 3]
        inverses.append(inverse)
    return inverses[0], inverses[1]
