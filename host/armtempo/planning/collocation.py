"""Collocation points, at which a program checks the limits: a grid, and peaks of the last solution between them."""

from __future__ import annotations

from dataclasses import dataclass
from math import perm

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.planning.fitness import scale_of
from armtempo.planning.variables import Index
from armtempo.splines import bspline, extremes, time_axis

_APART = 1e-7
"""Points of one segment closer than this are merged."""
_ZOOMS = 6
"""Number of parabolas through each peak, each on a quarter of the step before."""


@dataclass(frozen=True, eq=False)
class Points:
    """Points of a motion by segment and u in [0, 1], each (P,), in order."""

    segment: Index
    u: Array

    def __add__(self, other: Points) -> Points:
        """The union, without nearly equal points."""
        segment = np.concatenate([self.segment, other.segment])
        u = np.concatenate([self.u, other.u])
        order = np.lexsort((u, segment))
        segment, u = segment[order], u[order]
        same = (np.diff(segment) == 0) & (np.diff(u) < _APART)
        keep = np.concatenate([[True], ~same])
        return Points(segment[keep], u[keep])


@dataclass(frozen=True, eq=False)
class Curve:
    """A motion by power coefficients: angles (J, S, k + 1), times (S, k + 1); limits (J, 3)."""

    angle: Array
    time: Array
    limits: Array

    def ratios(self, segment: Index, u: Array) -> Array:
        """|speed|, |acceleration|, |jerk| over their limits at points (P,): (3, J, P)."""
        return self._ratios(self.angle[:, segment], self.limits.T[:, :, None], segment, u)

    def own_ratios(self, joint: Index, segment: Index, u: Array) -> Array:
        """As ``ratios``, of one joint at each point, (P,): (3, P)."""
        return self._ratios(self.angle[joint, segment], self.limits[joint].T, segment, u)

    def _ratios(self, angle: Array, limits: Array, segment: Index, u: Array) -> Array:
        """Ratios for power coefficients of angles (..., P, k + 1) and their limits."""
        q1, q2, q3 = _derivatives(angle, u)
        t1, t2, t3 = _derivatives(self.time[segment], u)
        speed = q1 / t1
        acceleration = (q2 - speed * t2) / t1**2
        jerk = (q3 - speed * t3 - acceleration * (3.0 * t1 * t2)) / t1**3
        return np.abs(np.stack([speed, acceleration, jerk])) / limits

    def angles_at(self, time_s: Array) -> Array:
        """Angles at times (N,): (N, J)."""
        segment, u = time_axis.parameter(self.time, time_s)
        return np.stack([bspline.evaluate(angle, segment, u) for angle in self.angle], axis=1)

    def scale(self) -> float:
        """The factor on time with which the motion just keeps its limits, proven."""
        ratios = extremes.magnitudes(self.angle, self.time) / self.limits
        return float(scale_of(ratios.T).max())


def grid(segments: int, parts: int, ends: bool = True) -> Points:
    """``parts`` points in every segment from its start; with ``ends`` also each end, else only the last."""
    u = np.linspace(0.0, 1.0, parts + 1)
    points = Points(np.repeat(np.arange(segments), parts + 1), np.tile(u, segments))
    keep = np.ones(len(points.u), dtype=bool) if ends else points.u < 1.0
    keep[-1] = True
    return Points(points.segment[keep], points.u[keep])


def peaks(curve: Curve, parts: int, least: float) -> Points:
    """Local maxima of ratios of at least ``least``, found on ``parts`` points per segment."""
    segments = len(curve.time)
    points = grid(segments, parts)
    ratios = curve.ratios(points.segment, points.u).reshape(3 * len(curve.angle), -1)
    beside = np.pad(ratios, ((0, 0), (1, 1)), constant_values=-1.0)
    high = (ratios >= beside[:, :-2]) & (ratios >= beside[:, 2:]) & (ratios >= least)
    high[:, parts :: parts + 1][:, :-1] |= high[
        :, parts + 1 :: parts + 1
    ]  # the same point of the next segment
    high[:, parts + 1 :: parts + 1] |= high[:, parts :: parts + 1][:, :-1]
    which, point = np.nonzero(high)
    if not len(point):
        return Points(points.segment[:0], points.u[:0])
    segment, u = points.segment[point], points.u[point]
    return _zoomed(curve, which, segment, u, 1.0 / parts)


def _zoomed(curve: Curve, which: Index, segment: Index, u: Array, step: float) -> Points:
    """The peaks near these points, by parabolas on decreasing steps."""
    column = np.arange(len(u))
    kind, joint = np.divmod(which, len(curve.angle))
    for _ in range(_ZOOMS):
        middle = np.clip(u, step, 1.0 - step)
        left, here, right = (
            curve.own_ratios(joint, segment, middle + shift)[kind, column] for shift in (-step, 0.0, step)
        )
        bend = 2.0 * here - left - right
        offset = np.divide(right - left, 2.0 * bend, out=np.sign(right - left), where=bend > 0)
        u = np.clip(middle + step * np.clip(offset, -1.0, 1.0), 0.0, 1.0)
        step *= 0.25
    order = np.lexsort((u, segment))
    return Points(segment[order], u[order])


def _derivatives(coefficients: Array, u: Array) -> list[Array]:
    """First three derivatives at u (P,) of polynomials (..., P, k + 1), each (..., P)."""
    found = []
    for order in (1, 2, 3):
        factors = [perm(power, order) for power in range(coefficients.shape[-1])]
        value = factors[-1] * coefficients[..., -1]
        for power in range(len(factors) - 2, order - 1, -1):
            value = value * u + factors[power] * coefficients[..., power]
        found.append(value)
    return found
