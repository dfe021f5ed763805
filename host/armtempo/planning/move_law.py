"""The time law of every move by hand: from rest to rest as fast as speed, acceleration and jerk allow.

Distance s(u) and time t(u) are uniform quintic B-splines. While the differences h of the time's control points are
equal, t = h u, and the differences of the distance's, over h, are the control points of the speed: those of a "double
S", the fastest speed f(t) under the limits, minus a constant c with which the speed begins at 0. Their first and second
differences, over h and h², are the control points of acceleration and jerk. As f keeps the limits, so do they, and the
splines between them. Where f'' is constant over five of them, the speed is f itself.

A higher limit of the speed never makes the distance shorter: f never falls with it, and h is the same, or, where f does
not reach the acceleration, f is the same function of t / h. At constant speed intervals may be of any length, as
s' / t' is then the ratio of the differences.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.model.parts import Limits
from armtempo.splines import bspline
from armtempo.splines.trajectory import JointSpline, Trajectory

DEGREE = 5
ACCELERATION, JERK = 0.8, 0.7
"""Fractions of the arm's limits for moves by hand. Braking may take 1.25 times the limits, and adds to what the motion
has: with all of them, rest after a release while the speed rises takes up to 1.43 times the shortest."""
SHORTEST_S = 0.05
"""Shortest duration of a move."""
_LEAST_PER_PHASE, _MOST_PER_PHASE = 1.5, 2.5
"""Steps h per phase of constant jerk. The least with which the jerk is reached; with the most the first step is f's."""
_PER_RAMP = 15.0
"""Most steps in a ramp, so that the record of six joints fits into the board's memory."""
_AT_START = np.array([1.0, 11.0, 11.0, 1.0]) / 24.0
"""Weights of the first control points in the speed at the start."""
_FIRST = -1.5
"""Time of the first control point of the speed, in h."""
_FIRST_TIMES = np.abs(np.arange(4) + _FIRST)
_LEAST_CRUISE = 9
"""In h; with a shorter one all intervals are equal."""
_SHORTEST_CRUISE = 0.01
"""In h: what is left for constant speed between the ramps."""
_GROWTH = 3.0
"""Largest ratio of neighbouring intervals."""
_LONGEST_S = 100.0
"""Longest interval: the board takes 163 s."""
_ROUNDS = 3


@dataclass(frozen=True)
class MoveLimits:
    """Largest magnitudes along the path, in its unit (deg or mm) and seconds."""

    speed: float
    acceleration: float
    jerk: float
    fastest: float = 0.0
    """The largest speed that may be asked for, if it is more than ``speed``."""

    def phase_s(self, speed: float) -> float:
        """Least time of constant jerk in a ramp to ``speed``."""
        return min(self.acceleration / self.jerk, math.sqrt(speed / self.jerk))

    def ramp_s(self, speed: float) -> float:
        """Least time from rest to ``speed``."""
        phase_s = self.phase_s(speed)
        return phase_s + speed / (self.jerk * phase_s)

    def peak(self, length: float) -> float:
        """The speed of the fastest move over ``length`` without a limit of the speed."""
        full = self.acceleration / self.jerk
        if length <= 2.0 * self.acceleration * full**2:
            return math.cbrt(0.25 * length**2 * self.jerk)
        return 0.5 * self.acceleration * (math.sqrt(full**2 + 4.0 * length / self.acceleration) - full)

    def step_s(self, speed: float, longest: float) -> float:
        """The interval h for a ramp to ``speed``; the distance in it is not longer than ``longest``."""
        fastest = max(self.fastest, self.speed)
        count = _PER_RAMP * self.phase_s(fastest) / self.ramp_s(fastest)
        return min(self.phase_s(speed) / min(max(count, _LEAST_PER_PHASE), _MOST_PER_PHASE), longest / speed)

    def lift(self, h: float, top: float) -> float:
        """The constant c of a ramp to ``top`` in steps ``h``."""
        return float(_AT_START @ self.rise(h * _FIRST_TIMES, top))

    def rise(self, time_s: Array, speed: float) -> Array:
        """The fastest speed after times from rest on, up to ``speed``."""
        phase_s = self.phase_s(speed)
        whole_s = self.ramp_s(speed)
        first = np.minimum(time_s, phase_s)
        last = np.clip(whole_s - time_s, 0.0, phase_s)
        between = np.clip(time_s, phase_s, whole_s - phase_s) - phase_s
        gained = first**2 + phase_s**2 - last**2
        return np.asarray(self.jerk * (0.5 * gained + phase_s * between))


def of_joints(limits: Sequence[Limits], gains: Sequence[float], speed: float) -> MoveLimits:
    """Limits of a path with joints that turn by ``gains`` (J,) > 0 degrees per unit of it.

    At the fraction ``speed`` of the joints' speeds. The jerk is so small that the fastest ramp has no more steps than
    its record.
    """
    rows = [np.array(limit.values) / gain for limit, gain in zip(limits, gains, strict=True)]
    fastest, acceleration, jerk = np.min(rows, axis=0) * (1.0, ACCELERATION, JERK)
    jerk = min(jerk, (_PER_RAMP / _LEAST_PER_PHASE - 1.0) * acceleration**2 / fastest)
    return MoveLimits(float(speed * fastest), float(acceleration), float(jerk), float(fastest))


@dataclass(frozen=True, eq=False)
class MoveLaw:
    """Control points of the distance (from 0 to its length) and of the time, both (n + DEGREE,)."""

    distance: Array
    time_s: Array

    def trajectory(self, name: str, angle_points_deg: Sequence[Array]) -> Trajectory:
        """The motion of joints with these control points (n + DEGREE,) in the law's time."""
        ends = (0, len(self.time_s) - DEGREE)
        rows = (JointSpline(DEGREE, 1, row, self.time_s, ends) for row in angle_points_deg)
        return Trajectory(name, tuple(rows), shared=True)

    @property
    def at_knots(self) -> Array:
        """The distance at the ends of the segments, (n + 1,)."""
        points = np.lib.stride_tricks.sliding_window_view(self.distance, DEGREE)
        return np.asarray(points @ bspline.basis(DEGREE)[0, :-1])


def law(length: float, limits: MoveLimits, longest: float = math.inf) -> MoveLaw:
    """The law for a path of ``length`` > 0; in no interval the distance is longer than ``longest``."""
    h = limits.step_s(limits.speed, longest)
    lift = limits.lift(h, limits.speed)
    ramp_s = limits.ramp_s(limits.speed + lift)
    is_long = length > ramp_s * (limits.speed - lift) + _LEAST_CRUISE * h * limits.speed
    found = _with_cruise(length, limits, h, longest) if is_long else None
    speeds, steps_s = found or _in_equal_steps(length, limits, longest)
    distance = np.append(0.0, (speeds * steps_s).cumsum())
    times = np.append(0.0, steps_s.cumsum())
    weights = bspline.basis(DEGREE)[0, :-1]
    distance -= weights @ distance[:DEGREE]
    times -= weights @ times[:DEGREE]
    # The sums are not exactly the integral, so the distance is scaled, and the time as far as the limits need it
    scale = length / float(weights @ distance[-DEGREE:])
    slower = max(1.0, scale, scale * float(speeds.max()) / limits.speed)
    slower = max(slower, SHORTEST_S / float(weights @ times[-DEGREE:]))
    return MoveLaw(distance * scale, times * slower)


def _with_cruise(length: float, limits: MoveLimits, h: float, longest: float) -> tuple[Array, Array] | None:
    """Control points of the speed, and the intervals, of a law with constant speed in the middle.

    None if there is no middle: the ramps have whole steps, so two of them may be longer than ``length``.
    """
    top = limits.speed + limits.lift(h, limits.speed)
    count = math.ceil(limits.ramp_s(top) / h) + DEGREE + 1
    rise = limits.rise(h * np.abs(np.arange(count) + _FIRST), top)
    rise -= limits.lift(h, top)
    weights = bspline.basis(DEGREE)[0, :-1]
    distances = np.append(0.0, (h * rise).cumsum())
    ramp = float(distances[-1] - weights @ distances[:DEGREE])
    cruise_s = (length - 2.0 * ramp) / float(rise[-1])
    if cruise_s < _SHORTEST_CRUISE * h:
        return None
    middle_s = _intervals(cruise_s, h, min(_LONGEST_S, longest / limits.speed))
    steps_s = np.array([*[h] * count, *middle_s, *[h] * count])
    return np.concatenate([rise, np.full(len(middle_s), rise[-1]), rise[::-1]]), steps_s


def _in_equal_steps(length: float, limits: MoveLimits, longest: float) -> tuple[Array, Array]:
    """Control points of the speed, and the intervals, of a law with little or no constant speed."""
    top, lift = limits.peak(length), 0.0
    for _ in range(_ROUNDS):
        top = min(limits.peak(length + 2.0 * lift * limits.ramp_s(top)), limits.speed + lift)
        h = limits.step_s(top, longest)
        lift = limits.lift(h, top)
    top = min(top, limits.speed + lift)
    ramp_s = limits.ramp_s(top)
    whole_s = 2.0 * ramp_s + max(0.0, length - ramp_s * (top - 2.0 * lift)) / (top - lift)
    count = math.ceil(whole_s / h - 1e-9)
    h = whole_s / count
    time_s = h * np.abs(np.arange(count + DEGREE - 1) + _FIRST)
    speeds = limits.rise(np.minimum(time_s, np.abs(whole_s - time_s)), top)
    return speeds - limits.lift(h, top), np.full(len(speeds), h)


def _intervals(whole_s: float, h: float, longest_s: float) -> list[float]:
    """Symmetric intervals with the sum ``whole_s``, increasing towards the middle."""
    side: list[float] = []
    length = h
    while (left_s := whole_s - 2.0 * sum(side)) > (length := min(_GROWTH * length, longest_s)):
        if length >= longest_s or left_s < 2.0 * length:
            break
        side.append(length)
    count = max(1, math.ceil(left_s / length - 1e-9))
    return [*side, *[left_s / count] * count, *reversed(side)]
