"""The library's inverse for many poses at once, for arms with a closed form."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armtempo.basics.arguments import checked
from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.kinematics.chain import spread_deg
from armtempo.kinematics.geometry import Geometry
from armtempo.kinematics.inverse import inverse
from armtempo.kinematics.ranges import TOLERANCE_RAD, Ranges
from armtempo.kinematics.shape import refusals
from armtempo.kinematics.solutions import OK
from armtempo.model.arm import Arm
from armtempo.model.pose import checked_all


@dataclass(frozen=True, eq=False)
class ManySolutions:
    """Joint angles for each of N tool poses."""

    angles_deg: Array
    """(N, 8, joints): whole turns added to lie in the ranges, nearest to the posture to stay near to; NaN if out of
    reach."""
    usable: NDArray[np.bool_]
    """(N, 8): within reach and all ranges, and not equal to an earlier one."""
    nearest_deg: Array
    """(N, joints): the usable solution nearest to that posture; NaN if there is none."""


@checked
def inverse_many(arm: Arm | Path | str, poses: ArrayLike, near_deg: ArrayLike | None = None) -> ManySolutions:
    """The eight solutions of each of many poses, some hundred thousand per second; ``inverse`` gives reasons
    for rejection.

    ``poses``: (N, 4, 4) or (N, 3, 4), lengths in mm; ``near_deg``, (joints,) or (J,): the posture to stay near to;
    None: home. Raises InputError for what is not a pose, and for an arm without a closed form.
    """
    arm = Arm.shape(arm)
    geometry, ranges = Geometry.of(arm), Ranges.of(arm)
    if reasons := refusals(geometry):
        raise InputError(
            f"arm {arm.name!r} has no closed-form inverse: {'; '.join(reasons)}",
            "use armtempo.inverse for each pose",
        )
    near = np.array(arm.all_home_deg) if near_deg is None else np.asarray(near_deg, dtype=float)
    if near.ndim != 1:
        raise InputError("near_deg must be one posture", "give an angle for each joint")
    near = np.radians(spread_deg(arm, near, "near_deg: "))
    found = inverse(geometry, checked_all(poses), near)
    angles, inside = _placed(ranges, found.angles_rad, near)
    usable = inside & (found.outcome == OK)
    distance = np.where(usable, np.linalg.norm(angles - near, axis=2), np.inf)
    best = angles[np.arange(len(angles)), distance.argmin(axis=1)]
    nearest = np.where(usable.any(axis=1)[:, None], best, np.nan)
    return ManySolutions(np.degrees(angles), usable, np.degrees(nearest))


def _placed(ranges: Ranges, angles: Array, near: Array) -> tuple[Array, NDArray[np.bool_]]:
    """``ranges.placed`` for angles (N, 8, joints), and whether all joints lie in their ranges then: (N, 8)."""
    low, high = ranges.low, ranges.high
    least = np.ceil((low - TOLERANCE_RAD - angles) / math.tau)
    most = np.floor((high + TOLERANCE_RAD - angles) / math.tau)
    turns = np.clip(np.round((near - angles) / math.tau), least, most)
    within = np.clip(angles + math.tau * turns, low, high)
    below, above = angles + math.tau * (least - 1.0), angles + math.tau * least
    beside = np.where(low - below < above - high, below, above)
    fits = least <= most
    return np.where(fits, within, beside), np.all(fits, axis=2)
