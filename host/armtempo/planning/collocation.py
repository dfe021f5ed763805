"""Points of u at which a program watches the limits: a grid, and the peaks that a solution shows between."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.planning.fitness import stretch_of
from armtempo.planning.variables import Index
from armtempo.splines import bspline, extremes, time_axis
from armtempo.splines.trajectory import derivatives

_APART = 1e-7
"""Points of one segment nearer than this are one."""
_ZOOMS = 6
"""Parabolas put through each peak, each on a step a quarter of the one before."""


@dataclass(frozen=True, eq=False)
class Points:
    """Points of a motion by segment and u in [0, 1], each (P,), in order."""

    segment: Index
    u: Array

    def __add__(self, other: Points) -> Points:
        """Both, without those that are nearly there already."""
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
        joints = []
        for angle, limits in zip(self.angle, self.limits, strict=True):
            values = [derivatives(angle, self.time, segment, u, order) for order in (1, 2, 3)]
            joints.append(np.abs(np.stack(values)) / limits[:, None])
        return np.stack(joints, axis=1)

    def angles_at(self, time_s: Array) -> Array:
        """Angles at times (N,): (N, J)."""
        segment, u = time_axis.parameter(self.time, time_s)
        return np.stack([bspline.evaluate(angle, segment, u) for angle in self.angle], axis=1)

    def stretch(self) -> float:
        """The factor on time that brings the motion just within its limits, proven."""
        ratios = extremes.magnitudes(self.angle, self.time) / self.limits
        return float(stretch_of(ratios.T).max())


def grid(segments: int, parts: int, ends: bool = True) -> Points:
    """``parts`` points from the start of every segment on; with ``ends`` also its end, else only the last one."""
    u = np.linspace(0.0, 1.0, parts + 1)
    points = Points(np.repeat(np.arange(segments), parts + 1), np.tile(u, segments))
    keep = np.ones(len(points.u), dtype=bool) if ends else points.u < 1.0
    keep[-1] = True
    return Points(points.segment[keep], points.u[keep])


def peaks(curve: Curve, parts: int, least: float) -> Points:
    """Where a ratio of at least ``least`` has a local maximum, as ``parts`` points a segment show it."""
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
    """The peaks near these points, by parabolas on ever smaller steps."""
    column = np.arange(len(u))
    for _ in range(_ZOOMS):
        middle = np.clip(u, step, 1.0 - step)
        left, here, right = (
            curve.ratios(segment, middle + shift).reshape(-1, len(u))[which, column]
            for shift in (-step, 0.0, step)
        )
        bend = 2.0 * here - left - right
        offset = np.divide(right - left, 2.0 * bend, out=np.sign(right - left), where=bend > 0)
        u = np.clip(middle + step * np.clip(offset, -1.0, 1.0), 0.0, 1.0)
        step *= 0.25
    order = np.lexsort((u, segment))
    return Points(segment[order], u[order])
