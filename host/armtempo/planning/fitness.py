"""The fitness that a search minimises: motion time and excess over the limits, for a whole population.

Only the intervals X vary, so everything that depends on the angles and the basis is computed once, on a grid
of u; a population then needs one matrix product and a few array operations.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from armtempo.model.parts import Limits
from armtempo.splines import bspline, time_axis
from armtempo.splines.bspline import Array

SAMPLES = 16
"""Grid intervals per path segment for the search; the finished plan is checked without a grid."""
_PENALTY = 30.0
"""Penalty of Eq. (21) in seconds for twice the limit."""
_TINY = 1e-300
"""Avoids 0 / 0 if a joint does not move."""


class Fitness:
    """Fitness of time intervals for one joint, or for several joints on one time axis.

    ``angle_points_deg``: (n + degree, J) control points; ``limits``: one per joint. A point to evaluate has n
    intervals in seconds (m = n below).
    """

    def __init__(self, angle_points_deg: Array, degree: int, limits: Sequence[Limits]) -> None:
        self.limits = np.array([limit.values for limit in limits])
        pieces = bspline.polynomials(angle_points_deg, degree)
        self.intervals = len(pieces)
        u = np.linspace(0.0, 1.0, SAMPLES + 1)
        grid = (len(u), -1, self.intervals, 1)  # (G, J, m, N): the population is the last axis, the fastest
        angles = [_on_grid(bspline.derivative(pieces, order), u) for order in (1, 2, 3)]
        self._angles = [np.ascontiguousarray(angle).reshape(grid) for angle in angles]
        self._times = _time_maps(self.intervals, degree, u)
        self._shape = (3, len(u), 1, self.intervals, -1)

    def ratios(self, intervals_s: Array) -> Array:
        """|speed|, |acceleration|, |jerk| over their limits on the grid: (3, G, J, m, N) for X (N, m).

        Eqs. (17) to (19), the last with the signs that differentiation gives.
        """
        t1, t2, t3 = (self._times @ intervals_s.T).reshape(self._shape)
        q1, q2, q3 = self._angles
        inverse = 1.0 / t1
        square = inverse * inverse
        result = np.empty((3, *q1.shape[:3], len(intervals_s)))
        speed = np.multiply(q1, inverse, out=result[0])
        acceleration = np.multiply(q2 - speed * t2, square, out=result[1])
        np.multiply(q3 - speed * t3 - acceleration * (3.0 * t1 * t2), square * inverse, out=result[2])
        np.abs(result, out=result)
        result *= (1 / self.limits).T[:, None, :, None, None]
        return result

    def peaks(self, intervals_s: Array) -> Array:
        """Largest ratios in each segment, (3, J, m, N): of the grid, and of parabolas through its points.

        If the top of a parabola through three points is outside of them, a smaller value than theirs is used.
        """
        ratios = self.ratios(intervals_s)
        return np.asarray(np.maximum(_tops(ratios).max(axis=1), np.maximum(ratios[:, 0], ratios[:, -1])))

    def penalised(self, intervals_s: Array) -> Array:
        """Eq. (21): sum of X and weighted excess of each segment's extremes, (N,) for X (N, m).

        The paper leaves its weights open; here each excess counts relative to its limit.
        """
        excess = np.maximum(self.peaks(intervals_s) - 1.0, 0.0).sum(axis=(0, 1, 2))
        return np.asarray(intervals_s.sum(axis=1) + _PENALTY * excess)

    def stretched(self, intervals_s: Array) -> Array:
        """Motion time after X is scaled or shrunk to just keep the limits, (N,) for X (N, m)."""
        return np.asarray(intervals_s.sum(axis=1) * self.scale(intervals_s))

    def scale(self, intervals_s: Array) -> Array:
        """The factor on X with which it just keeps the limits on the grid: (N,)."""
        ratios = self.ratios(intervals_s)
        everywhere = (1, 2, 3)
        return scale_of(np.maximum(_tops(ratios).max(axis=everywhere), ratios.max(axis=everywhere)))


def _tops(ratios: Array) -> Array:
    """Tops of parabolas through three successive points, (3, G - 2, J, m, N); see ``peaks``."""
    left, middle, right = ratios[:, :-2], ratios[:, 1:-1], ratios[:, 2:]
    slope = np.abs(left - right)
    bend = middle + middle
    bend -= left
    bend -= right
    half = 0.5 * slope
    np.maximum(bend, half, out=bend)
    bend += _TINY
    tops = np.multiply(half, half, out=half)
    tops *= 0.5
    tops /= bend
    tops += middle
    return tops


def scale_of(ratios: Array) -> Array:
    """Least factor on time with which ``ratios`` (3, ...) of speed, acceleration and jerk are at most 1."""
    return np.asarray(np.maximum(np.maximum(ratios[0], np.sqrt(ratios[1])), np.cbrt(ratios[2])))


def _on_grid(pieces: Array, u: Array) -> Array:
    """Values (G, J, m) of polynomials (m, k + 1, J) at each u of (G,)."""
    powers = u[:, None] ** np.arange(pieces.shape[1])
    return np.asarray(np.einsum("gp,mpj->gjm", powers, pieces))


def _time_maps(count: int, degree: int, u: Array) -> Array:
    """The matrix from intervals to t', t'', t''' on the grid, stacked: (3 * G * m, m)."""
    pieces = bspline.polynomials(np.ascontiguousarray(time_axis.step_map(count, degree).T), degree)
    maps = [_on_grid(bspline.derivative(pieces, order), u).swapaxes(1, 2) for order in (1, 2, 3)]
    return np.concatenate(maps).reshape(-1, count)
