"""The time law of a jog: rest, constant speed, rest; it can be braked quickly at any time.

Way s(u) and time t(u) are uniform quintic B-splines. The differences of their control points are

    of t:  h h h h   h h h h  H1 H2 ...  h h h h   h h h h
    of s:  0 0 0 0   v times those of t            0 0 0 0

so both ends are at rest, the speed rises over 4 h like the sum of a B-spline, and is exactly v while all its
differences have the ratio v, for any intervals H. On a ramp the acceleration is v/h times the cubic basis
spline, whose maximum is 2/3, and the jerk v/h² times its derivative, also at most 2/3.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.splines import bspline

DEGREE = 5
_REST, _RAMP = 4, 4
"""Number of zero differences at an end, and number of differences of its ramp."""
_PEAK = 2.0 / 3.0
_SHORTEST_S = 0.01
_GROWTH = 3.0
"""Largest ratio of neighbouring intervals."""
_HALVINGS = 80


@dataclass(frozen=True)
class WayLimits:
    """Largest magnitudes along the way, in its unit (deg or mm) and seconds."""

    speed: float
    acceleration: float
    jerk: float

    def ramp_s(self, speed: float) -> float:
        """The interval h of a ramp to ``speed``."""
        return max(_SHORTEST_S, _PEAK * speed / self.acceleration, math.sqrt(_PEAK * speed / self.jerk))


@dataclass(frozen=True, eq=False)
class WayLaw:
    """Control points of the way (from 0 to its length) and of the time, both (n + DEGREE,)."""

    way: Array
    time_s: Array

    @property
    def at_knots(self) -> Array:
        """The way at the ends of the segments, (n + 1,)."""
        points = np.lib.stride_tricks.sliding_window_view(self.way, DEGREE)
        return np.asarray(points @ bspline.basis(DEGREE)[0, :-1])


def law(length: float, limits: WayLimits, longest: float = math.inf, short_ramps: bool = False) -> WayLaw:
    """The law for a way of ``length`` > 0; in no interval H the way is longer than ``longest``.

    ``short_ramps``: nor in an interval h, by a lower speed if necessary.
    """
    least = 2 * _RAMP
    speed = limits.speed
    if short_ramps and speed * limits.ramp_s(speed) > longest:
        speed = _fitting_speed(longest, limits)
    if least * speed * limits.ramp_s(speed) > length:
        speed = _fitting_speed(length / least, limits)
        h = length / (least * speed)
    else:
        h = limits.ramp_s(speed)
    middle_s = length / speed - least * h
    steps_s = [h] * _RAMP + _intervals(middle_s, h, longest / speed) + [h] * _RAMP
    rest = np.zeros(_REST)
    way = np.concatenate(([0.0], rest, speed * np.array(steps_s), rest)).cumsum()
    times = np.concatenate(([0.0], np.full(_REST, h), steps_s, np.full(_REST, h))).cumsum()
    begins_s = float(times[: DEGREE + 1] @ bspline.basis(DEGREE)[0])
    return WayLaw(way * (length / way[-1]), times - begins_s)


def _fitting_speed(way: float, limits: WayLimits) -> float:
    """The speed v with v h(v) = ``way``, by bisection of its logarithm."""
    low, high = limits.speed * 1e-9, limits.speed
    for _ in range(_HALVINGS):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if middle * limits.ramp_s(middle) < way else (low, middle)
    return low


def _intervals(whole_s: float, h: float, longest_s: float) -> list[float]:
    """Symmetric intervals with the sum ``whole_s``, increasing towards the middle."""
    if whole_s <= 1e-9 * h:
        return []
    side: list[float] = []
    length = h
    while (left_s := whole_s - 2.0 * sum(side)) > (length := min(_GROWTH * length, longest_s)):
        if length >= longest_s or left_s < 2.0 * length:
            break
        side.append(length)
    count = max(1, math.ceil(left_s / length - 1e-9))
    return [*side, *[left_s / count] * count, *reversed(side)]
