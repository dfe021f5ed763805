"""The exact steps of a joint, computed from its B-splines by SciPy and bisection: no code of armtempo's.

Angles are in steps, times in ticks, along the parameter u from 0 to the number of path segments.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline, PPoly

TICK_HZ = 84_000_000
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Crossings:
    """Where the angle crosses half a step, in order."""

    ticks: Array
    directions: NDArray[np.int64]
    """+1 or -1"""


class ExactJoint:
    """One joint of a trajectory file; ``steps_per_deg`` from the arm in it."""

    def __init__(self, angle_points_deg: Array, time_points_s: Array, degree: int, refine: int,
                 steps_per_deg: float) -> None:  # fmt: skip
        self.segments = len(angle_points_deg) - degree
        self._angle = _uniform(angle_points_deg * steps_per_deg, degree, 1)
        self._time = _uniform(time_points_s * TICK_HZ, degree, refine)
        self.start = round(float(self._angle(0.0)))
        self.end = float(self._angle(self.segments))
        self.duration_ticks = float(self._time(self.segments))
        self._turns = self._monotone_ends()

    def crossings(self) -> Crossings:
        """All of them; a turn of the spline exactly on a threshold is none."""
        ticks, directions = [], []
        for low, high in zip(self._turns[:-1], self._turns[1:], strict=True):
            first, last = float(self._angle(low)), float(self._angle(high))
            sign = 1 if last > first else -1
            bottom, top = sorted((first, last))
            halves = np.arange(np.floor(bottom + 0.5), np.ceil(top + 0.5)) + 0.5
            halves = halves[(halves > bottom) & (halves < top)][::sign]
            u = _bisect(lambda u: sign * self._angle(u), sign * halves, low, high)  # noqa: B023
            ticks.append(self._time(u))
            directions.append(np.full(len(u), sign))
        return Crossings(np.concatenate(ticks), np.concatenate(directions))

    def angle(self, ticks: Array) -> Array:
        """Angle at these times; at rest before 0 and after the end."""
        return np.asarray(self._angle(self._u(ticks)))

    def rate(self, ticks: Array) -> Array:
        """Speed at these times, steps/s, without sign."""
        u = self._u(ticks)
        return np.asarray(np.abs(self._angle(u, 1) / self._time(u, 1))) * TICK_HZ

    def turn_ticks(self) -> Array:
        """Both ends, and where the joint turns round."""
        return np.asarray(self._time(np.array(self._turns)))

    def _u(self, ticks: Array) -> Array:
        inside = np.clip(ticks, 0.0, self.duration_ticks)
        return _bisect(self._time, inside, 0.0, float(self.segments))

    def _monotone_ends(self) -> list[float]:
        slope = PPoly.from_spline(self._angle.derivative())
        roots = slope.roots(discontinuity=False, extrapolate=False)
        inside = roots[(roots > 0.0) & (roots < self.segments)]
        return [0.0, *np.sort(inside), float(self.segments)]


def _uniform(points: Array, degree: int, refine: int) -> BSpline:
    """The uniform B-spline with these control points; a knot every 1 / refine."""
    knots = np.arange(-degree, len(points) + 1) / refine
    return BSpline(knots, points, degree, extrapolate=False)


def _bisect(function: Any, values: Array, low: float, high: float) -> Array:
    """Where an increasing function takes each of the values, to the last bit."""
    below, above = np.full(len(values), low), np.full(len(values), high)
    for _ in range(60):
        middle = (below + above) / 2
        under = function(middle) < values
        below, above = np.where(under, middle, below), np.where(under, above, middle)
    return above
