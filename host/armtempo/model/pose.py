"""Poses from a matrix, or from a position with roll-pitch-yaw angles or a quaternion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError

LARGEST = 1e9
"""Larger lengths in mm and angles in degrees are typing errors; a result would have no correct digit."""

ROUNDED = 1e-3
"""Tolerance for rotations and unit quaternions that were rounded for printing."""


ORTHONORMAL = 1e-14
"""A matrix whose columns are orthonormal within this is a rotation to the last digit."""


class RollPitchYaw(NamedTuple):
    """Angles in degrees about the x, then the y, then the z axis of the base."""

    roll_deg: float
    pitch_deg: float
    yaw_deg: float


class Quaternion(NamedTuple):
    """A unit quaternion, its real part first."""

    w: float
    x: float
    y: float
    z: float


def checked(matrix: ArrayLike, what: str = "the pose") -> Array:
    """A (4, 4) pose with its rotation made exact; raises InputError, naming ``what``, if it is not a pose.

    A rounded rotation is replaced by the nearest one (by singular value decomposition).
    """
    try:
        pose = np.array(matrix, dtype=np.float64)
    except ValueError:  # rows of different lengths
        pose = np.empty(0)
    if pose.shape == (3, 4):
        pose = np.vstack((pose, (0.0, 0.0, 0.0, 1.0)))
    if pose.shape != (4, 4):
        raise InputError(
            f"{what}: what is given is not the matrix of a pose",
            "give 4 rows of 4 numbers, or the first 3 of them",
        )
    if not np.all(np.abs(pose) <= LARGEST):
        raise InputError(
            f"{what}: one of its numbers is too large or no number",
            f"every number of a pose must be finite, and at most {LARGEST:g}",
        )
    if np.abs(pose[3] - (0.0, 0.0, 0.0, 1.0)).max() > 1e-9:
        raise InputError(
            f"{what}: the last row of a pose is 0 0 0 1, not {' '.join(f'{v:g}' for v in pose[3])}",
            "write 0 0 0 1, with the position in the last column",
        )
    pose[:3, :3] = _nearest_rotation(pose[:3, :3], what)
    pose[3] = (0.0, 0.0, 0.0, 1.0)
    return pose


def checked_rows(matrix: ArrayLike) -> list[float]:
    """The 16 elements of ``checked`` in row order; fast for an exact matrix."""
    given = np.asarray(matrix, dtype=np.float64)
    if given.shape in ((3, 4), (4, 4)):
        rows = given.ravel().tolist()
        a, b, c, x, d, e, f, y, g, h, i, z = rows[:12]
        exact = (
            abs(a * a + d * d + g * g - 1.0) < ORTHONORMAL
            and abs(b * b + e * e + h * h - 1.0) < ORTHONORMAL
            and abs(c * c + f * f + i * i - 1.0) < ORTHONORMAL
            and abs(a * b + d * e + g * h) < ORTHONORMAL
            and abs(a * c + d * f + g * i) < ORTHONORMAL
            and abs(b * c + e * f + h * i) < ORTHONORMAL
            and a * (e * i - f * h) + b * (f * g - d * i) + c * (d * h - e * g) > 0.0
        )
        if exact and max(map(abs, (x, y, z))) <= LARGEST and rows[12:] in ([], [0.0, 0.0, 0.0, 1.0]):
            return [*rows[:12], 0.0, 0.0, 0.0, 1.0]
    return [float(number) for number in checked(matrix).ravel()]


def checked_all(matrices: ArrayLike) -> Array:
    """As ``checked`` for N poses, (N, 4, 4) or (N, 3, 4): (N, 4, 4). The InputError names the first invalid one."""
    given = np.array(matrices, dtype=np.float64)
    if given.ndim != 3 or given.shape[1:] not in ((3, 4), (4, 4)):
        raise InputError(
            f"poses of shape {given.shape} are not a list of poses", "give N times 4 rows of 4 numbers"
        )
    poses = np.tile(np.eye(4), (len(given), 1, 1))
    poses[:, : given.shape[1]] = given
    with np.errstate(invalid="ignore", over="ignore"):
        off = np.abs(np.swapaxes(poses[:, :3, :3], 1, 2) @ poses[:, :3, :3] - np.eye(3)).max(axis=(1, 2))
        fine = (off < ORTHONORMAL) & (np.linalg.det(np.nan_to_num(poses[:, :3, :3])) > 0.0)
        fine &= np.all(poses[:, 3] == (0.0, 0.0, 0.0, 1.0), axis=1)
        fine &= np.all(np.abs(poses) <= LARGEST, axis=(1, 2))
    for number in np.flatnonzero(~fine):  # rounded, or invalid
        poses[number] = checked(poses[number], f"pose {number + 1}")
    return poses


def _nearest_rotation(part: Array, what: str) -> Array:
    left, stretch, right = np.linalg.svd(part)
    off = float(np.abs(stretch - 1.0).max())
    if off > ROUNDED:
        raise InputError(
            f"{what}: the 3 x 3 part is not a rotation (off by {off:.3g}, {ROUNDED:g} allowed)",
            "its columns must have length 1 and be perpendicular: give more digits, or roll, pitch and yaw",
        )
    rotation: Array = left @ right
    if np.linalg.det(rotation) < 0.0:
        raise InputError(f"{what}: the 3 x 3 part is a mirror image (left-handed)", "swap or negate a column")
    # an exact matrix is not changed
    return part if np.abs(rotation - part).max() < 1e-14 else rotation


def from_rpy(position: Sequence[float], rpy_deg: Sequence[float], what: str = "the pose") -> Array:
    """Pose of shape (4, 4): roll about x, then pitch about y, then yaw about z, all axes of the base."""
    cosines, sines = zip(*((_cos_deg(angle), _sin_deg(angle)) for angle in rpy_deg), strict=True)
    (cr, cp, cy), (sr, sp, sy) = cosines, sines
    rotation = (
        (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        (-sp, cp * sr, cp * cr),
    )
    return _joined(rotation, position, what)


def from_quaternion(position: Sequence[float], wxyz: Sequence[float], what: str = "the pose") -> Array:
    """Pose of shape (4, 4) from a unit quaternion, real part w first; it is normalised."""
    length = math.hypot(*wxyz)
    if not abs(length - 1.0) <= ROUNDED:
        raise InputError(
            f"{what}: this quaternion has length {length:.6g}",
            "give w x y z of length 1, w (the real part) first",
        )
    w, x, y, z = (value / length for value in wxyz)
    rotation = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    return _joined(rotation, position, what)


def to_rpy_deg(matrix: ArrayLike) -> RollPitchYaw:
    """Roll, pitch and yaw of a pose (4, 4) or rotation (3, 3); roll is 0 if the x axis is vertical."""
    r = np.asarray(matrix, dtype=np.float64)
    level = math.hypot(r[0, 0], r[1, 0])
    pitch = math.atan2(-r[2, 0], level)
    if level < 1e-9:
        return RollPitchYaw(0.0, _degrees(pitch), _degrees(math.atan2(-r[0, 1], r[1, 1])))
    roll, yaw = math.atan2(r[2, 1], r[2, 2]), math.atan2(r[1, 0], r[0, 0])
    return RollPitchYaw(_degrees(roll), _degrees(pitch), _degrees(yaw))


def angle_deg(rotation: ArrayLike) -> float:
    """The angle of a rotation (3, 3), degrees from 0 to 180."""
    w, *vector = to_quaternion(rotation)
    return math.degrees(2.0 * math.atan2(math.hypot(*vector), w))


def _degrees(angle_rad: float) -> float:
    """Degrees in (-180, 180], never -0."""
    angle_deg = math.degrees(angle_rad)
    return 180.0 if angle_deg < -180.0 + 1e-9 else angle_deg + 0.0


def to_quaternion(matrix: ArrayLike) -> Quaternion:
    """Unit quaternion w x y z of a pose (4, 4) or rotation (3, 3), with w >= 0."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = np.asarray(matrix, dtype=np.float64)[:3, :3].tolist()
    # four times the products of the quaternion's elements; the row with the largest square is the most
    # accurate
    rows = (
        (1 + xx + yy + zz, zy - yz, xz - zx, yx - xy),
        (zy - yz, 1 + xx - yy - zz, xy + yx, xz + zx),
        (xz - zx, xy + yx, 1 - xx + yy - zz, yz + zy),
        (yx - xy, xz + zx, yz + zy, 1 - xx - yy + zz),
    )
    best = max(rows, key=lambda row: math.hypot(*row))
    length = math.hypot(*best) * (-1.0 if best[0] < 0.0 else 1.0)
    return Quaternion(*(element / length + 0.0 for element in best))


def _joined(rotation: ArrayLike, position: Sequence[float], what: str) -> Array:
    return checked(np.column_stack((rotation, position)), what)


def _cos_deg(angle_deg: float) -> float:
    """Cosine, exact at multiples of a quarter turn."""
    return _sin_deg(90.0 - angle_deg) if abs(angle_deg) <= LARGEST else math.nan


def _sin_deg(angle_deg: float) -> float:
    """Sine, exact at multiples of a quarter turn; NaN for an angle that is not finite or beyond LARGEST."""
    if not abs(angle_deg) <= LARGEST:
        return math.nan
    quarter, rest = divmod(angle_deg + 45.0, 90.0)
    rest = math.radians(rest - 45.0)
    return (math.sin(rest), math.cos(rest), -math.sin(rest), -math.cos(rest))[int(quarter) % 4]
