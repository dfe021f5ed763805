"""The time axis: time over u as a uniform B-spline with increasing control points.

The control points are the sums 0, X1, X1 + X2, ... of the intervals X, mirrored at both ends. So t = 0 at the
start, t = sum(X) at the end, and t' is a B-spline of the positive X, hence positive.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armtempo.splines import bspline
from armtempo.splines.bspline import Array

_NEWTON_STEPS = 60
"""Bound on iterations: each at least halves the bracket, and Newton's method doubles the digits."""


def control_points(intervals_s: ArrayLike, degree: int) -> Array:
    """Time control points (..., m + degree) of the intervals (..., m)."""
    intervals = np.asarray(intervals_s, dtype=float)
    edge = (degree - 1) // 2
    steps = intervals[..., mirrored(intervals.shape[-1], edge)]
    points = np.zeros((*intervals.shape[:-1], intervals.shape[-1] + degree))
    np.cumsum(steps, axis=-1, out=points[..., 1:])
    return np.asarray(points - points[..., edge : edge + 1])


def mirrored(count: int, edge: int) -> NDArray[np.intp]:
    """Indices 0..count-1 with ``edge`` mirrored ones on each side: 1 0 0 1 2 ... for edge 2."""
    return np.pad(np.arange(count), edge, mode="symmetric")


def refined(differences_s: Array, parts: int, degree: int) -> Array:
    """Differences of the control points of the same axis with each segment divided into ``parts``.

    ``differences_s``: (m + degree - 1,). Returns (m * parts + degree - 1,). They are the control points of t',
    a spline of degree - 1.
    """
    return bspline.refined(differences_s, parts, degree - 1) / parts


@cache
def step_map(count: int, degree: int) -> Array:
    """The linear map from intervals to control points: (count, count + degree)."""
    matrix = control_points(np.eye(count), degree)
    matrix.setflags(write=False)
    return matrix


def parameter(coefficients: Array, time_s: Array) -> tuple[NDArray[np.intp], Array]:
    """Segment and u in [0, 1] at the times ``time_s`` (any shape, clamped to the range).

    ``coefficients``: (m, degree + 1), seconds in power basis. By Newton's method within a bracket.
    """
    starts = coefficients[:, 0]
    segment = np.clip(np.searchsorted(starts, time_s, side="right") - 1, 0, len(starts) - 1)
    slope, at = bspline.derivative(coefficients), np.ravel(segment)
    begin, end = starts[at], np.append(starts[1:], coefficients[-1].sum())[at]
    wanted = np.clip(np.ravel(time_s), begin, end)
    found: Array = (wanted - begin) / (end - begin)
    moving = np.flatnonzero((wanted > begin) & (wanted < end))  # indices of those that have not converged
    wanted, at, now = wanted[moving], at[moving], found[moving]
    low, high = np.zeros(now.shape), np.ones(now.shape)
    for _ in range(_NEWTON_STEPS):
        error = bspline.evaluate(coefficients, at, now) - wanted
        low, high = np.where(error <= 0, now, low), np.where(error >= 0, now, high)
        step = now - error / bspline.evaluate(slope, at, now)
        step = np.where((step >= low) & (step <= high), step, 0.5 * (low + high))
        found[moving] = step
        moves = (np.abs(step - now) >= 1e-15) & (np.abs(error) > 2.0 * np.spacing(wanted))  # beyond rounding
        if not np.any(moves):
            break
        moving, at = moving[moves], at[moves]
        wanted, now, low, high = wanted[moves], step[moves], low[moves], high[moves]
    return segment, found.reshape(np.shape(time_s))


def cut(differences_s: Array, before: int, refine: int, degree: int) -> Array:
    """The axis with ``refine`` instead of ``before`` segments; exact for a multiple, else approximate."""
    if refine % before == 0:
        return refined(differences_s, refine // before, degree)
    fine = refined(differences_s, refine, degree)
    count = (len(differences_s) - degree + 1) // before * refine + degree - 1
    return np.asarray(np.interp(np.linspace(0, 1, count), np.linspace(0, 1, len(fine)), fine) * before)
