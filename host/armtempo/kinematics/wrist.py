"""Joints 4 to 6 from many orientations: the algebraic half of section 2.1, Eqs. (8) to (11).

Unlike the paper, which divides by sin(theta4) or sin(theta5), this computes sine and cosine of each angle
from Eq. (8) and their arctan2, so the quadrant is defined and there is no division by a value near zero.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.kinematics import formulas
from armtempo.kinematics.formulas import ARRAYS
from armtempo.kinematics.geometric import ArmPart
from armtempo.kinematics.regions import Mask
from armtempo.kinematics.shape import STRAIGHT_WRIST, Shape


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

    ``previous4``, (N,) or (), is the Denavit-Hartenberg angle theta4 to keep if theta5 = 0.
    """
    fore = arm.fore
    in_plane = [formulas.in_arm_plane(*arm.turn1, x, y) for x, y, _ in axes]
    along, heights = [part[:, None] for part, _ in in_plane], axes[:, 2]
    n_x, o_x, a_x = (formulas.along_x3(*fore, part, z) for part, z in zip(along, heights, strict=True))
    n_y, o_y, a_y = (formulas.along_y3(shape, across)[:, None] for _, across in in_plane)
    a_z = formulas.along_z3(shape, *fore, along[2], heights[2])

    sin5 = np.sqrt(a_x * a_x + a_y * a_y)
    singular = sin5 <= STRAIGHT_WRIST
    if singular.any():
        a_y = np.broadcast_to(a_y, a_x.shape).copy()
        np.copyto(a_x, shape.sign5 * np.cos(previous4), where=singular)
        np.copyto(a_y, shape.sign5 * np.sin(previous4), where=singular)
    return WristPart(
        formulas.theta4(ARRAYS, shape, a_x, a_y),
        formulas.theta5(ARRAYS, shape, sin5, a_z),
        formulas.theta6(ARRAYS, shape, (a_x, a_y), (n_x, n_y), (o_x, o_y)),
        singular,
    )
