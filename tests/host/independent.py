"""A plan looked at without the planner's own splines and bounds: scipy's B-splines, sampled densely."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from armtempo.model.plan import Plan
from armtempo.splines.trajectory import JointSpline
from scipy.interpolate import BSpline

POINTS = 40
"""Samples in a segment of the time axis."""


@dataclass(frozen=True)
class Sampled:
    """A joint at many points of its spline parameter u, in order."""

    u: np.ndarray
    time_s: np.ndarray
    angle_deg: np.ndarray
    rates: np.ndarray
    """Speed, acceleration, jerk: (3, K)."""


def sampled(spline: JointSpline, points: int = POINTS) -> Sampled:
    """By the chain rule from derivatives by u."""
    degree = spline.degree
    segments = len(spline.angle_points_deg) - degree
    angle = _bspline(spline.angle_points_deg, degree, 1.0)
    time = _bspline(spline.time_points_s, degree, 1.0 / spline.refine)
    u = np.linspace(0.0, segments, segments * spline.refine * points + 1)
    u[-1] = np.nextafter(segments, 0.0)
    q, q1, q2, q3 = (angle(u, order) for order in range(4))
    t, t1, t2, t3 = (time(u, order) for order in range(4))
    speed = q1 / t1
    acceleration = (q2 - speed * t2) / t1**2
    jerk = (q3 - 3.0 * acceleration * t1 * t2 - speed * t3) / t1**3
    return Sampled(u, t, q, np.array([speed, acceleration, jerk]))


def _bspline(points: np.ndarray, degree: int, step: float) -> BSpline:
    knots = step * np.arange(-degree, len(points) + 1)
    return BSpline(knots, points, degree)


def faults(plan: Plan, at_via_deg: float = 1e-7, points: int = POINTS) -> list[str]:
    """What is wrong with a plan; empty if nothing is. Poses with a tolerance are not checked."""
    found = []
    shared = plan.trajectory.shared
    for number, (joint, spline) in enumerate(zip(plan.arm.driven, plan.trajectory.joints, strict=True)):
        at = sampled(spline, points)
        size = max(1.0, float(np.abs(at.angle_deg).max()))
        limits = np.array(joint.limits.values)[:, None]
        excess = np.abs(at.rates) / limits - 1.0
        if excess.max() > 1e-9:
            excess -= _rounding(spline, at, points) / limits
        if excess.max() > 1e-9:
            found.append(f"{joint.name}: a limit is exceeded by {excess.max():.2e} of it")
        if np.any(np.diff(at.time_s) <= 0.0):
            found.append(f"{joint.name}: time does not increase")
        low, high = joint.range_deg
        if at.angle_deg.min() < low - 1e-9 * size or at.angle_deg.max() > high + 1e-9 * size:
            found.append(f"{joint.name}: leaves its range")
        found += _at_vias(plan, number, at_via_deg * size)
        found += _at_stops(plan, number)
        ends = np.abs(at.rates[: 2 if spline.degree == 5 else 1][:, [0, -1]])
        allowed = 1e-5 * limits[: len(ends)]
        if np.any(ends > allowed):
            allowed = allowed + _rounding(spline, at, points)[: len(ends), [0, -1]]
        if np.any(ends > allowed):
            found.append(f"{joint.name}: is not at rest at its ends")
        if shared and not np.array_equal(spline.time_points_s, plan.trajectory.joints[0].time_points_s):
            found.append(f"{joint.name}: has a time axis of its own")
    return found


def _at_stops(plan: Plan, number: int) -> list[str]:
    """Dwells that are shorter than asked for, or in which the joint moves."""
    spline, found = plan.trajectory.joints[number], []
    time = _bspline(spline.time_points_s, spline.degree, 1.0 / spline.refine)
    angle = _bspline(spline.angle_points_deg, spline.degree, 1.0)
    for stop in plan.job.stops:
        if stop.dwell_s and spline.via_segments:
            u = float(spline.via_segments[stop.via]) + np.linspace(0.0, np.ceil(5.0 / spline.refine), 21)
            lasts_s = float(time(u[-1]) - time(u[0]))
            moves_deg = float(np.ptp(angle(u)))
            if lasts_s < stop.dwell_s * (1 - 1e-9) or moves_deg > 1e-9 * max(1.0, np.abs(angle(u)).max()):
                found.append(f"joint {number + 1}: dwells for {lasts_s:.9g} s and moves {moves_deg:.2e} deg")
    return found


def _rounding(spline: JointSpline, at: Sampled, points: int) -> np.ndarray:
    """What the last bit of each control point, a 64-bit float, does to the rates: (3, K).

    Much if a segment far from angle 0 or late in a motion takes hardly any time, as between repeated via points.
    """
    rng = np.random.default_rng(1)
    largest = np.zeros_like(at.rates)
    for _ in range(8):
        angle_deg, time_s = (
            values + rng.integers(-1, 2, len(values)) * np.spacing(np.abs(values).max())
            for values in (spline.angle_points_deg, spline.time_points_s)
        )
        other = sampled(replace(spline, angle_points_deg=angle_deg, time_points_s=time_s), points)
        largest = np.maximum(largest, np.abs(other.rates - at.rates))
    return 3.0 * largest


def _at_vias(plan: Plan, number: int, nearest_deg: float) -> list[str]:
    spline = plan.trajectory.joints[number]
    angle = _bspline(spline.angle_points_deg, spline.degree, 1.0)
    knots = spline.via_segments or range(len(plan.via_deg))
    at = np.minimum(np.array(knots, dtype=float), np.nextafter(knots[-1], 0.0))
    off = np.abs(angle(at) - plan.via_deg[:, number]).max()
    return [f"joint {number + 1}: passes a via point by {off:.2e} deg"] if off > nearest_deg else []
