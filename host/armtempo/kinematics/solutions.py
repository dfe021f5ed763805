"""Results of the closed form: angles of the eight solutions, their outcomes, and singularities."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from armtempo.basics.arrays import Array

OK, TOO_FAR, TOO_NEAR, IN_OFFSET, DUPLICATE = range(5)
"""The outcome of a solution: there, or Eq. (3) violated at the outer or inner border, or the wrist centre
nearer to axis 1 than the shoulder offset, or equal to an earlier solution."""
OUT_OF_REACH = TOO_FAR, TOO_NEAR, IN_OFFSET
"""Outcomes without angles."""

ON_AXIS_1, ELBOW_STRETCHED, WRIST_STRAIGHT = 1, 2, 4
"""Bits of ``singular``."""


@dataclass(frozen=True)
class Solutions:
    """Eight solutions for each of N poses.

    Solution 4 * base + 2 * elbow + wrist: base 0 front, 1 rear; elbow 0 up, 1 down; wrist 0 with
    theta5 >= 0, 1 flipped. The arrays are views: copy them if memory order matters.
    """

    angles_rad: Array
    """(N, 8, joints): joint angles in [-pi, pi]; NaN if out of reach."""
    outcome: NDArray[np.uint8]
    """(N, 8): OK, TOO_FAR, TOO_NEAR, IN_OFFSET or DUPLICATE."""
    singular: NDArray[np.uint8]
    """(N, 8): bits ON_AXIS_1, ELBOW_STRETCHED (or folded), WRIST_STRAIGHT (theta5 = 0)."""


class PoseSolutions(NamedTuple):
    """The eight solutions of one pose, as plain numbers; order and meaning as in ``Solutions``."""

    angles_rad: list[tuple[float, ...]]
    """8 times joints."""
    outcome: list[int]
    """8"""
    singular: list[int]
    """8"""
