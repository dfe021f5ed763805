"""Shortest time of one joint between standstills under speed, acceleration and jerk limits, in closed form.

A lower bound for every time law on a path: a joint stands still at its turning points, whatever the other joints do.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.model.parts import Limits

_ROUNDING = 8 * float(np.finfo(float).eps)
"""Allowance for rounding: a distance may be shorter by this fraction of the largest angle."""
_LEAST_SHARE = 0.05
"""Least time of a leg in which the joints hardly move, as a fraction of the mean."""


def lower_bound_s(
    angles_deg: Array, limits: Limits, from_rest: bool = True, to_rest: bool | None = None
) -> float:
    """Least time to pass ``angles_deg`` (turning points with both ends) in order.

    The acceleration is also zero at the first if ``from_rest``, at the last if ``to_rest`` (None: as at the
    first); at the others it is free, as a joint may turn with full acceleration.
    """
    to_rest = from_rest if to_rest is None else to_rest
    distances = np.maximum(np.abs(np.diff(angles_deg)) - _ROUNDING * float(np.max(np.abs(angles_deg))), 0.0)
    last = len(distances) - 1
    return sum(
        _leg_s(float(distance), limits, from_rest and number == 0, to_rest and number == last)
        for number, distance in enumerate(distances)
    )


def _leg_s(distance: float, limits: Limits, from_rest: bool, to_rest: bool) -> float:
    """Least time over one monotone interval: accelerate, perhaps cruise, decelerate."""
    low, high = 0.0, limits.speed_deg_s
    up, distance_up = _ramp(high, limits, from_rest)
    down, distance_down = _ramp(high, limits, to_rest)
    if distance_up + distance_down <= distance:
        return up + down + (distance - distance_up - distance_down) / high
    for _ in range(60):
        speed = 0.5 * (low + high)
        up, distance_up = _ramp(speed, limits, from_rest)
        down, distance_down = _ramp(speed, limits, to_rest)
        low, high = (speed, high) if distance_up + distance_down < distance else (low, speed)
    return up + down


def _ramp(speed: float, limits: Limits, from_rest: bool) -> tuple[float, float]:
    """Time and distance from standstill to ``speed``, with zero acceleration at the end.

    The initial acceleration is zero if ``from_rest``, else free within its limit.
    """
    top, jerk = limits.acceleration_deg_s2, limits.jerk_deg_s3
    ramps = 2.0 if from_rest else 1.0  # jerk phases; each changes the speed by a² / 2 J
    peak = min(top, math.sqrt(2.0 * jerk * speed / ramps))
    phase = peak / jerk
    held = (speed - ramps * peak * phase / 2.0) / peak if peak > 0 else 0.0
    time = held + ramps * phase
    if from_rest:
        return time, speed * time / 2.0
    before = held * peak
    return time, before * held / 2.0 + before * phase + peak * phase**2 / 3.0


def stopping_s(via_deg: Array, limits: Sequence[Limits], together: bool = True) -> float:
    """Least time through via angles (n + 1, J) with a rest at each; ``together``: all joints leave each together."""
    each = np.array(
        [
            [lower_bound_s(np.array(ends), limit) for ends in pairwise(angles)]
            for angles, limit in zip(via_deg.T.tolist(), limits, strict=True)
        ]
    )
    return float(each.max(axis=0).sum() if together else each.sum(axis=1).max())


def needed_s(via_deg: Array, limits: Array) -> Array:
    """Estimated time of J joints between neighbouring via points (n + 1, J), from rest to rest: (n,).

    ``limits``: (J, 3). At least a fraction of the mean.
    """
    distances = np.abs(np.diff(via_deg, axis=0))
    speed, acceleration, jerk = limits.T
    needs = np.maximum(
        distances / speed,
        np.maximum(np.sqrt(4.0 * distances / acceleration), np.cbrt(32.0 * distances / jerk)),
    )
    needed = needs.max(axis=1)
    return np.asarray(np.maximum(needed, _LEAST_SHARE * needed.mean()))
