"""Joints 4 to 6 from the orientation: the algebraic half of section 2.1, Eqs. (8) to (11).

Where the paper divides by sin(theta4) or sin(theta5), this takes both sine and cosine of each angle from
Eq. (8) and their arctan2: no quadrant to guess and nothing to divide by near zero.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from armtempo.kinematics.geometric import ArmPart
from armtempo.kinematics.geometry import Array
from armtempo.kinematics.regions import Mask
from armtempo.kinematics.shape import Shape

SINGULAR = 1e-10
"""Sine of theta5 up to which theta4 is taken from the previous posture, and the error of orientation, in rad,
that this allows."""


class WristPart(NamedTuple):
    """Joints 4 to 6 as Denavit-Hartenberg angles in (-pi, pi], for the solution with theta5 >= 0.

    Shape of each: (2, 2, N), axes as in ArmPart. The flipped solution is theta4 + pi, -theta5, theta6 + pi.
    """

    theta4: Array
    theta5: Array
    theta6: Array
    singular: Mask


def solve_wrist(shape: Shape, arm: ArmPart, axes: Array, previous4: Array) -> WristPart:
    """Find joints 4 to 6 for orientations ``axes``: (3, 3, N), [axis n, o, a of Eq. (1), component].

    ``previous4``, (N,) or (), is the Denavit-Hartenberg angle theta4 to keep where theta5 = 0.
    """
    along, across = _in_arm_plane(arm.theta1, axes)
    height = axes[:, 2]
    cos, sin = np.cos(arm.fore), np.sin(arm.fore)
    sin_up = shape.sign1 * sin
    # Components along the axes x3, y3, z3 of the forearm's frame.
    n_x, o_x, a_x = (cos * along[i][:, None] + sin_up * height[i] for i in range(3))
    n_y, o_y, a_y = (-shape.sign1 * shape.sign2 * shape.sign3 * across[i][:, None] for i in range(3))
    a_z = shape.sign2 * shape.sign3 * (sin * along[2][:, None] - shape.sign1 * cos * height[2])

    sin5 = np.sqrt(a_x * a_x + a_y * a_y)
    theta4 = np.arctan2(shape.sign5 * a_y, shape.sign5 * a_x)
    singular = sin5 <= SINGULAR
    with np.errstate(invalid="ignore", divide="ignore"):
        scale = shape.sign5 / sin5
        cos4, sin4 = scale * a_x, scale * a_y
    if singular.any():
        np.copyto(theta4, np.broadcast_to(previous4, theta4.shape), where=singular)
        np.copyto(cos4, np.cos(theta4), where=singular)
        np.copyto(sin4, np.sin(theta4), where=singular)
    theta5 = np.arctan2(sin5, -shape.sign4 * shape.sign5 * a_z)
    turn = shape.sign4 * shape.sign5
    theta6 = np.arctan2(turn * (sin4 * n_x - cos4 * n_y), turn * (sin4 * o_x - cos4 * o_y))
    return WristPart(theta4, theta5, theta6, singular)


def _in_arm_plane(theta1: Array, axes: Array) -> tuple[list[Array], list[Array]]:
    """Components of n, o, a along the arm's plane and across it: three arrays (2, N) each."""
    cos, sin = np.cos(theta1), np.sin(theta1)
    along = [cos * axes[i, 0] + sin * axes[i, 1] for i in range(3)]
    across = [cos * axes[i, 1] - sin * axes[i, 0] for i in range(3)]
    return along, across
