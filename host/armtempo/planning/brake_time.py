"""The time in which a motion can brake to rest from anywhere on its path.

The board brakes by letting the motion's own time run slower and slower: its rate falls from 1 to 0 as
1 - (10 x³ - 15 x⁴ + 6 x⁵), x = time since the stop command / brake time, so the arm stays on its path.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from armtempo.errors import InputError
from armtempo.model.arm import Limits
from armtempo.splines.bspline import Array
from armtempo.splines.trajectory import Trajectory

EXCESS = 1.25
"""Multiple of the acceleration and jerk limits that braking may reach. Within the limits themselves a motion that
is already at them could only brake very slowly: braking adds to the acceleration and jerk of the path."""

_STARTS = 400
_PHASES = 40
_SAMPLES = 4000


def brake_time_s(trajectory: Trajectory, limits: Sequence[Limits]) -> float:
    """Shortest brake time, in seconds, that keeps EXCESS times the limits wherever braking starts.

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
    while _excess(time, motion, allowed, high) > EXCESS:
        high *= 2
    low = high / 2
    while high > 1.01 * low:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _excess(time, motion, allowed, middle) > EXCESS else (low, middle)
    return high


def _excess(time: Array, motion: list[Array], allowed: Array, brake_s: float) -> float:
    """Largest acceleration or jerk over its limit while braking in ``brake_s``, over all starts."""
    x = np.linspace(0.0, 1.0, _PHASES + 1)
    rate = 1 - x**3 * (10 - 15 * x + 6 * x**2)
    rate1 = -30 * x**2 * (1 - x) ** 2 / brake_s
    rate2 = -60 * x * (1 - x) * (1 - 2 * x) / brake_s**2
    passed = x - x**4 * (2.5 - 3 * x + x**2)
    at = time[:: _SAMPLES // _STARTS, None] + brake_s * passed
    worst = 0.0
    for joint, (_, acceleration_limit, jerk_limit) in enumerate(allowed):
        speed, acceleration, jerk = (np.interp(at, time, values[:, joint], right=0.0) for values in motion)
        braked2 = acceleration * rate**2 + speed * rate1
        braked3 = jerk * rate**3 + 3 * acceleration * rate * rate1 + speed * rate2
        worst = max(worst, np.abs(braked2).max() / acceleration_limit, np.abs(braked3).max() / jerk_limit)
    return float(worst)
