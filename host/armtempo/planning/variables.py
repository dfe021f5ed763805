"""The layout of a motion's control points as variables of a program, and their basis functions at points of u.

A motion of J joints on S segments has S + k angle control points per joint and S + k - 1 differences of time
control points. With a fixed path only the differences vary.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import perm
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from armtempo.basics.arrays import Array
from armtempo.splines import bspline

if TYPE_CHECKING:
    from scipy.sparse import csr_array

Index = NDArray[np.intp]


@dataclass(frozen=True)
class MotionVariables:
    """Numbers of segments, degree, and joints whose angles vary (0 for a fixed path)."""

    segments: int
    degree: int
    joints: int

    @property
    def angles(self) -> int:
        """Number of angle control points per joint."""
        return self.segments + self.degree

    @property
    def differences(self) -> int:
        """Number of differences of time control points."""
        return self.segments + self.degree - 1

    @property
    def size(self) -> int:
        """Number of variables: the angles joint by joint, then the differences."""
        return self.joints * self.angles + self.differences

    def angle_index(self, joint: int) -> Index:
        """Variables that are the control points of a joint: (S + k,)."""
        return joint * self.angles + np.arange(self.angles)

    @property
    def difference_index(self) -> Index:
        """Variables that are differences of time control points: (S + k - 1,)."""
        return self.joints * self.angles + np.arange(self.differences)

    @property
    def places(self) -> Array:
        """Position of each variable along the motion: (size,)."""
        angles = np.tile(np.arange(self.angles, dtype=float), self.joints)
        return np.concatenate([angles, np.arange(self.differences) + 0.5])

    def pack(self, angle_points: Array, differences: Array) -> Array:
        """The variables of control points (S + k, J) and differences (S + k - 1,)."""
        return np.concatenate([angle_points.T.ravel(), differences])

    def angle_points(self, x: Array) -> Array:
        """Angle control points (S + k, J) of the variables."""
        return np.asarray(x[: self.joints * self.angles].reshape(self.joints, self.angles).T)

    def time_differences(self, x: Array) -> Array:
        """Differences of time control points (S + k - 1,) of the variables."""
        return np.asarray(x[self.joints * self.angles :])


def angle_basis(degree: int, u: Array, orders: tuple[int, ...] = (1, 2, 3)) -> Array:
    """Weights of a segment's k + 1 control points in the derivatives at u (P,): (P, orders, k + 1)."""
    matrix = bspline.basis(degree)
    places, back = np.unique(u, return_inverse=True)  # those of a grid are the same in each segment
    powers = [places[:, None] ** power for power in range(degree + 1)]
    rows = np.zeros((len(places), len(orders), degree + 1))
    for number, order in enumerate(orders):
        for power in range(order, degree + 1):
            rows[:, number] += perm(power, order) * powers[power - order] * matrix[power]
    return np.asarray(rows[back])


def time_basis(degree: int, u: Array) -> Array:
    """Weights of a segment's k differences in the first three derivatives of time at u (P,): (P, 3, k)."""
    return by_differences(angle_basis(degree, u))


def by_differences(basis: Array) -> Array:
    """The weights (..., k + 1) of control points as those of their k differences, (..., k)."""
    return np.asarray(basis[..., ::-1].cumsum(axis=-1)[..., -2::-1])


def time_points(differences: Array, degree: int) -> Array:
    """Time control points (m + k,) of their differences, with t = 0 at the start."""
    points = np.concatenate([[0.0], np.cumsum(differences)])
    return np.asarray(points - points[: degree + 1] @ bspline.basis(degree)[0])


def derivative_matrix(bases: Array, segment: Index, count: int) -> csr_array:
    """First, second and third derivatives at all points, (3 P, count), from ``bases`` (P, 3, w) of their segments."""
    from scipy.sparse import csr_array  # imported here, because that takes longer than most commands

    points, _, width = bases.shape
    columns = np.tile(segment[:, None] + np.arange(width), (3, 1)).ravel()
    starts = np.arange(0, 3 * points * width + 1, width)
    return csr_array((bases.swapaxes(0, 1).ravel(), columns, starts), shape=(3 * points, count))
