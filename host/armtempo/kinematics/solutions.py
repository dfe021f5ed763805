"""Results of the closed form: the eight solutions with their outcomes, singularities and branches."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armtempo.basics.arrays import Array
from armtempo.kinematics.geometry import Geometry
from armtempo.kinematics.shape import Shape

OK, TOO_FAR, TOO_NEAR, IN_OFFSET, DUPLICATE = range(5)
"""The outcome of a solution: there, or Eq. (3) violated at the outer or inner border, or the wrist centre
nearer to axis 1 than the shoulder offset, or equal to an earlier solution."""
OUT_OF_REACH = TOO_FAR, TOO_NEAR, IN_OFFSET
"""Outcomes without angles."""

ON_AXIS_1, ELBOW_STRETCHED, WRIST_STRAIGHT = 1, 2, 4
"""Bits of ``singular``."""
BORDER = 1e-9
"""Sine, or length relative to the reach, below which an arm is on the border of two branches."""
BASES, ELBOWS, WRISTS = ("front", "rear"), ("up", "down"), ("plain", "flipped")


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


class Branch(NamedTuple):
    """Branch names of base, elbow and wrist; "" on a border."""

    base: str
    """"front": the arm reaches forwards over its shoulder; "rear": backwards."""
    elbow: str
    """"up" or "down"."""
    wrist: str
    """"plain": sine of theta5 positive; "flipped": negative."""

    def __str__(self) -> str:
        return " ".join(filter(None, self)) or "on the border of all branches"

    def after(self, before: Branch) -> Branch:
        """This branch, with undefined parts taken from the branch before."""
        return Branch(*(mine or theirs for mine, theirs in zip(self, before, strict=True)))

    def differs(self, other: Branch) -> tuple[str, ...]:
        """The parts that differ between this branch and ``other``, if both are defined."""
        return tuple(
            part
            for part, mine, theirs in zip(self._fields, self, other, strict=True)
            if mine and theirs and mine != theirs
        )


BRANCHES = tuple(Branch(base, elbow, wrist) for base in BASES for elbow in ELBOWS for wrist in WRISTS)
"""In the order of ``Solutions``."""


def branch_of(geometry: Geometry, angles_rad: ArrayLike) -> Branch:
    """The branch of joint angles, rad (joints,). Raises InputError for an arm without a closed form."""
    shape = Shape.of(geometry)
    theta = np.asarray(angles_rad, dtype=np.float64)[geometry.core] + np.array(shape.joint_offset)
    stretch = shape.sign2 * theta[2] + shape.bend
    direction = theta[1] - shape.turn2
    forward = shape.shoulder + shape.upper * np.cos(direction) + shape.fore * np.cos(direction + stretch)
    base = _sign(forward / geometry.moving.reach)
    elbow = -shape.sign1 * (base or 1) * _sign(np.sin(stretch))
    return Branch(_word(BASES, base), _word(ELBOWS, elbow), _word(WRISTS, _sign(np.sin(theta[4]))))


def _sign(value: np.float64) -> float:
    return 0.0 if abs(value) < BORDER else float(np.sign(value))


def _word(words: tuple[str, str], sign: float) -> str:
    return words[sign < 0] if sign else ""
