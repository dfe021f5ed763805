"""Collocation points, at which a program checks the limits: a grid, and peaks of the last solution between them."""

from __future__ import annotations

from dataclasses import dataclass, replace
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
class Ratios:
    """Ratios of a joint's speed (``kind`` 0), acceleration (1) or jerk (2) to its limit at points, each (R,).

    ``share``: the part of the limit that is allowed there.
    """

    points: Points
    kind: Index
    joint: Index
    share: Array

    @classmethod
    def grid(cls, segments: int, joints: int, parts: tuple[int, int, int]) -> Ratios:
        """Every joint's speed, acceleration and jerk at so many points of each segment."""
        kinds = []
        for kind, count in enumerate(parts):
            points = grid(segments, count, ends=False)
            each = Points(np.repeat(points.segment, joints), np.repeat(points.u, joints))
            own = np.tile(np.arange(joints), len(points.u))
            kinds.append(cls(each, np.full(len(own), kind), own, np.ones(len(own))))
        return kinds[0] + kinds[1] + kinds[2]

    def tightened(self, curve: Curve, peaks: Ratios) -> Ratios:
        """With lower shares in each segment where peaks of the curve exceed the limit: by as much as they do."""
        joints, segments = curve.angle.shape[:2]
        heights = curve.own_ratios(peaks.joint, peaks.points.segment, peaks.points.u)
        excess = np.ones((3 * joints, segments))
        peak = peaks.kind * joints + peaks.joint, peaks.points.segment
        np.maximum.at(excess, peak, heights[peaks.kind, np.arange(len(peaks.kind))])
        row, segment = self.kind * joints + self.joint, self.points.segment
        before = excess[row, np.where(self.points.u == 0.0, np.maximum(segment - 1, 0), segment)]
        return replace(self, share=self.share / np.maximum(excess[row, segment], before))

    def __add__(self, other: Ratios) -> Ratios:
        """Both, these first, without those of ``other`` that are nearly equal to one of these."""
        own = [self.kind, self.joint, self.points.segment, self.points.u, self.share]
        more = [other.kind, other.joint, other.points.segment, other.points.u, other.share]
        both = [np.concatenate(pair) for pair in zip(own, more, strict=True)]
        order = np.lexsort((both[3], both[2], both[1], both[0]))
        near = np.diff(both[3][order]) < _APART
        for each in both[:3]:
            near &= np.diff(each[order]) == 0
        keep = np.ones(len(order), dtype=bool)
        keep[np.maximum(order[1:], order[:-1])[near]] = False
        kind, joint, segment, u, share = (each[keep] for each in both)
        return Ratios(Points(segment, u), kind, joint, share)


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


def peaks(curve: Curve, parts: int, least: float) -> Ratios:
    """Local maxima of ratios of at least ``least``, found on ``parts`` points per segment, in order of u."""
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
    kind, joint = np.divmod(which, len(curve.angle))
    segment, u = points.segment[point], points.u[point]
    if len(point):
        u = _zoomed(curve, kind, joint, segment, u, 1.0 / parts)
    order = np.lexsort((u, segment))
    return Ratios(Points(segment[order], u[order]), kind[order], joint[order], np.ones(len(order)))


def _zoomed(curve: Curve, kind: Index, joint: Index, segment: Index, u: Array, step: float) -> Array:
    """The u of the peaks near these points, by parabolas on decreasing steps."""
    column = np.arange(len(u))
    for _ in range(_ZOOMS):
        middle = np.clip(u, step, 1.0 - step)
        left, here, right = (
            curve.own_ratios(joint, segment, middle + shift)[kind, column] for shift in (-step, 0.0, step)
        )
        bend = 2.0 * here - left - right
        offset = np.divide(right - left, 2.0 * bend, out=np.sign(right - left), where=bend > 0)
        u = np.clip(middle + step * np.clip(offset, -1.0, 1.0), 0.0, 1.0)
        step *= 0.25
    return u


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
