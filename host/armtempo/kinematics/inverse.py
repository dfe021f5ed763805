"""The hybrid inverse of section 2.1: all eight solutions for many poses at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armtempo.kinematics.geometric import ArmPart, duplicates, on_border, solve_arm
from armtempo.kinematics.geometry import Array, Geometry
from armtempo.kinematics.shape import Shape
from armtempo.kinematics.wrist import WristPart, solve_wrist

CHUNK = 8192
"""Poses solved at once: many enough to hide the cost of a call, few enough to stay in the caches."""

OK, TOO_FAR, TOO_NEAR, IN_OFFSET, DUPLICATE = range(5)
"""What became of a solution: there, or Eq. (3) violated at the outer or inner border, or the wrist centre
nearer to axis 1 than the shoulder offset, or equal to an earlier solution."""

ON_AXIS_1, ELBOW_STRETCHED, WRIST_STRAIGHT = 1, 2, 4
"""Bits of ``Solutions.singular``."""


@dataclass(frozen=True)
class Solutions:
    """Eight solutions for each of N poses.

    Solution 4 * base + 2 * elbow + wrist: base 0 front, 1 rear; elbow 0 up, 1 down; wrist 0 with
    theta5 >= 0, 1 flipped. The arrays are views: copy them if memory order matters.
    """

    angles_rad: Array
    """(N, 8, 6): joint angles in [-pi, pi]; NaN where out of reach."""
    outcome: NDArray[np.uint8]
    """(N, 8): OK, TOO_FAR, TOO_NEAR, IN_OFFSET or DUPLICATE."""
    singular: NDArray[np.uint8]
    """(N, 8): bits ON_AXIS_1, ELBOW_STRETCHED (or folded), WRIST_STRAIGHT (theta5 = 0)."""


def inverse(geometry: Geometry, poses: ArrayLike, previous_rad: ArrayLike | None = None) -> Solutions:
    """Return all solutions for ``poses``, shape (N, 4, 4) or (4, 4), lengths in the geometry's unit.

    ``previous_rad``, (6,) or (N, 6), default all zero, decides what a singular pose leaves free. The rotation
    part must be a rotation, see ``pose.checked``. Raises InputError for an arm outside the class.
    """
    shape = Shape.of(geometry)
    matrices = np.asarray(poses, dtype=np.float64).reshape(-1, 16)
    previous = np.zeros(6) if previous_rad is None else np.asarray(previous_rad, dtype=np.float64)
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


def wrist_centre(shape: Shape, pose: Array) -> Array:
    """Eq. (2) for poses as (12 or 16, N) elements in row order: the wrist centre, (3, N)."""
    along, out = shape.flange
    cos, sin = shape.flange_twist
    centre: Array = pose[3:12:4] - along * (cos * pose[2:12:4] + sin * pose[1:12:4])
    return centre - out * pose[0:12:4] if out else centre


def _solve(shape: Shape, matrices: Array, previous: Array) -> tuple[ArmPart, WristPart]:
    pose = np.ascontiguousarray(matrices.T)
    arm = solve_arm(shape, wrist_centre(shape, pose), previous)
    cos, sin = shape.flange_twist
    n, o, a = pose[0:12:4], pose[1:12:4], pose[2:12:4]
    axes = np.stack((n, o, a) if sin == 0.0 and cos == 1.0 else (n, cos * o - sin * a, cos * a + sin * o))
    return arm, solve_wrist(shape, arm, axes, previous[..., 3])


def _angles_into(out: Array, shape: Shape, arm: ArmPart, wrist: WristPart) -> None:
    """Write the six angles, offsets taken off and wrapped, for both wrists: out (6, 2, 2, 2, n)."""
    half_turn4 = np.copysign(np.pi, wrist.theta4)
    half_turn6 = np.copysign(np.pi, wrist.theta6)
    wide = (arm.theta1[:, None], arm.theta2, arm.theta3)
    for joint, theta in enumerate(wide):
        out[joint] = _wrapped(theta - shape.joint_offset[joint])[:, :, None]
    np.copyto(out[0], np.nan, where=np.isnan(out[1]))
    flipped = (wrist.theta4 - half_turn4, -wrist.theta5, wrist.theta6 - half_turn6)
    for joint, (plain, turned) in enumerate(zip(wrist[:3], flipped, strict=True), start=3):
        out[joint, :, :, 0], out[joint, :, :, 1] = plain, turned
        if shape.joint_offset[joint]:
            out[joint] = _wrapped(out[joint] - shape.joint_offset[joint])


def _wrapped(angle: Array) -> Array:
    """Bring angles into [-pi, pi]."""
    wrapped: Array = angle - 2 * np.pi * np.rint(angle * (0.5 / np.pi))
    return wrapped


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
