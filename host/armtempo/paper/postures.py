"""Table 2: the eight solutions for the pose in Eq. (16)."""

from __future__ import annotations

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.kinematics.geometry import Geometry
from armtempo.kinematics.inverse import inverse
from armtempo.model.arm import Arm
from armtempo.paper import printed
from armtempo.paper.printed import DIFFERS, SAME, Claim

_ROUNDING_DEG = 0.1
"""The table has one decimal; sums of its angles are accurate to this."""


def claims(arm: Arm) -> list[Claim]:
    """One claim for each printed posture."""
    geometry = Geometry.of(arm)
    pose = np.array(printed.POSE)
    pose[:3, 3] *= printed.SCALE_MM
    ours = np.degrees(inverse(geometry, pose, np.radians(printed.SOLUTIONS[0])).angles_rad[0])
    return [_claim(ours, row) for row in range(len(printed.SOLUTIONS))]


def _claim(ours: Array, row: int) -> Claim:
    given = np.array(printed.SOLUTIONS[row])
    wanted = given.copy()
    wrong, column = printed.SOLUTION_MISPRINT
    because = ""
    if row == wrong:
        wanted[column] = 180.0
        because = "misprint: θ6 must be 180; with the printed value the pose is turned by 180°"
    nearest, away = _nearest(ours, wanted)
    verdict = SAME if away <= _ROUNDING_DEG and not because else DIFFERS
    if away > _ROUNDING_DEG:
        because = f"no solution within {_ROUNDING_DEG} degrees"
    return Claim("Table 2", f"posture {row + 1} (°)", _text(given), _text(nearest), verdict, because)


def _nearest(ours: Array, wanted: Array) -> tuple[Array, float]:
    """Our solution closest to a printed one, modulo 360 degrees, and the largest difference.

    At theta5 = 0 only theta4 + theta6 is defined, so there the sum is compared.
    """
    turned = ours + 360.0 * np.rint((wanted - ours) / 360.0)
    off = np.abs(turned - wanted)
    if abs(wanted[4]) < _ROUNDING_DEG:
        total = (turned[:, 3] + turned[:, 5]) - (wanted[3] + wanted[5])
        off[:, 3] = off[:, 5] = np.abs(total - 360.0 * np.rint(total / 360.0))
    worst = np.nanmax(np.where(np.isnan(off), np.inf, off), axis=1)
    best = int(np.argmin(worst))
    return turned[best], float(worst[best])


def _text(angles: Array) -> str:
    return " ".join(f"{angle + 0.0:.1f}" for angle in np.round(angles, 1))
