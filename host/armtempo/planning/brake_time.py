"""The time in which a motion can brake to rest, or change its speed otherwise, anywhere on its path.

The board lets the motion's own time run at another rate, so the arm stays on its path: in the brake time the rate goes
from r0 to r1 as r0 + (r1 - r0) (10 x³ - 15 x⁴ + 6 x⁵), x = time since its beginning / brake time. Braking is r1 = 0;
so are a change of speed, a pause, and going on.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from armtempo.basics.errors import InputError
from armtempo.model.parts import Limits
from armtempo.splines.bspline import Array
from armtempo.splines.trajectory import Trajectory

EXCESS = 1.25
"""Multiple of the acceleration and jerk limits that braking and changes of speed may reach. Within the
limits themselves a motion that is already at them could only brake very slowly: braking adds to the acceleration and
jerk of the path."""

RATES = ((1.0, 0.0), (0.0, 1.0), (1.0, 0.5), (0.5, 1.0), (1.0, 0.75), (0.75, 1.0), (0.9, 0.2), (0.2, 0.9))
"""Rates before and after, for which the brake time is found; between others less is needed."""

_LONGER = 1.05
_STARTS = 400
_PHASES = 40
_SAMPLES = 4000


def brake_time_s(trajectory: Trajectory, limits: Sequence[Limits]) -> float:
    """Shortest brake time, in seconds, that keeps EXCESS times the limits wherever a change of rate starts.

    One of ``limits`` for each joint. Speed never rises. Found on a grid of starts and times, to 1 %.
    Raises InputError where the motion itself exceeds EXCESS times the limits.
    """
    time = np.linspace(0.0, trajectory.duration_s, _SAMPLES)
    motion = [trajectory(time, order) for order in (1, 2, 3)]
    allowed = np.array([limit.values for limit in limits])
    if any(np.any(np.abs(motion[n]) > EXCESS * allowed[:, n]) for n in (1, 2)):
        raise InputError(
            f"the motion {trajectory.name!r} goes beyond the arm's acceleration or jerk limits",
            "plan it again",
        )
    high = 0.01
    whole = RATES[:2]
    while _excess(time, motion, allowed, high, whole) > EXCESS:
        high *= 2
    low = high / 2
    while high > 1.01 * low:
        middle = 0.5 * (low + high)
        low, high = (
            (middle, high) if _excess(time, motion, allowed, middle, whole) > EXCESS else (low, middle)
        )
    while _excess(time, motion, allowed, high, RATES[2:]) > EXCESS:
        high *= _LONGER
    return high


def _excess(
    time: Array, motion: list[Array], allowed: Array, brake_s: float, rates: Sequence[tuple[float, float]]
) -> float:
    """Largest acceleration or jerk over its limit during changes between ``rates``, over all starts."""
    x = np.linspace(0.0, 1.0, _PHASES + 1)
    slopes = [
        np.vstack((np.diff(values, axis=0) / np.diff(time)[:, None], 0.0 * values[:1])) for values in motion
    ]
    worst = 0.0
    for before, after in rates:
        change = after - before
        rate = before + change * x**3 * (10 - 15 * x + 6 * x**2)
        rate1 = change * 30 * x**2 * (1 - x) ** 2 / brake_s
        rate2 = change * 60 * x * (1 - x) * (1 - 2 * x) / brake_s**2
        passed = before * x + change * x**4 * (2.5 - 3 * x + x**2)
        at = time[:: _SAMPLES // _STARTS, None] + brake_s * passed
        place = np.searchsorted(time, at, side="right") - 1  # the same for all joints
        beyond = at > time[-1]
        for joint, (_, acceleration_limit, jerk_limit) in enumerate(allowed):
            speed, acceleration, jerk = (
                np.where(beyond, 0.0, values[place, joint] + slope[place, joint] * (at - time[place]))
                for values, slope in zip(motion, slopes, strict=True)
            )
            changed2 = acceleration * rate**2 + speed * rate1
            changed3 = jerk * rate**3 + 3 * acceleration * rate * rate1 + speed * rate2
            worst = max(
                worst, np.abs(changed2).max() / acceleration_limit, np.abs(changed3).max() / jerk_limit
            )
    return float(worst)
