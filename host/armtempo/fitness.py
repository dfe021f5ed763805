"""What a search minimises: motion time and excess over the limits, for a whole population at once.

Angles are fixed, only the intervals X vary, so everything of the angle and of the basis is computed once,
on a grid of u; a population then costs one matrix product and a few array operations.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from armtempo import spline, timeaxis
from armtempo.arm import Limits
from armtempo.spline import Array

SAMPLES = 16
"""Parts of a path segment between the grid points that the search looks at; the finished plan is checked
without a grid."""

_PENALTY = 30.0
"""Seconds that the penalty of Eq. (21) charges where a limit is exceeded by as much again."""


class Fitness:
    """Fitness of time intervals for one joint, or for several on one time axis.

    ``angle_points_deg``: (n + degree, J) control points; ``limits``: one for each joint. A point to
    evaluate has n * refine intervals in seconds.
    """

    def __init__(
        self,
        angle_points_deg: Array,
        degree: int,
        limits: Sequence[Limits],
        refine: int = 1,
        samples: int = SAMPLES,
    ) -> None:
        self.limits = np.array([limit.values for limit in limits])
        pieces = spline.subdivide(spline.polynomials(angle_points_deg, degree), refine)
        self.intervals = len(pieces)
        u = np.linspace(0.0, 1.0, max(5, -(-samples // refine) + 1))
        self._grid = len(u)
        angles = [_on_grid(spline.derivative(pieces, order), u) for order in (1, 2, 3)]
        self._angles = [np.ascontiguousarray(angle.T)[None] for angle in angles]
        self._times = _time_maps(self.intervals, degree, u)

    def ratios(self, intervals_s: Array) -> Array:
        """|speed|, |acceleration|, |jerk| over their limits on the grid: (3, N, J, G) for X (N, m).

        Eqs. (17) to (19), the last with the signs that differentiation gives.
        """
        times = (intervals_s @ self._times).reshape(len(intervals_s), 3, 1, -1)
        t1, t2, t3 = times[:, 0], times[:, 1], times[:, 2]
        q1, q2, q3 = self._angles
        inverse = 1.0 / t1
        square = inverse * inverse
        result = np.empty((3, len(intervals_s), *q1.shape[1:]))
        speed = np.multiply(q1, inverse, out=result[0])
        acceleration = np.multiply(q2 - speed * t2, square, out=result[1])
        np.multiply(q3 - 3 * acceleration * (t1 * t2) - speed * t3, square * inverse, out=result[2])
        np.abs(result, out=result)
        result *= (1 / self.limits).T[:, None, :, None]
        return result

    def peaks(self, intervals_s: Array) -> Array:
        """Largest ratios in each segment, (3, N, J, m): of the grid, and of parabolas through its points."""
        ratios = self.ratios(intervals_s)
        ratios = ratios.reshape(*ratios.shape[:3], self.intervals, self._grid)
        left, middle, right = ratios[..., :-2], ratios[..., 1:-1], ratios[..., 2:]
        slope = np.abs(left - right)
        bend = 2 * middle - left - right
        tops = np.divide(slope * slope, 8 * bend, out=np.zeros_like(bend), where=slope < 2 * bend) + middle
        return np.asarray(np.maximum(tops.max(axis=4), np.maximum(ratios[..., 0], ratios[..., -1])))

    def penalised(self, intervals_s: Array) -> Array:
        """Eq. (21): sum of X and weighted excess of each segment's extremes, (N,) for X (N, m).

        The paper leaves its weights open; here each excess counts relative to its limit.
        """
        excess = np.maximum(self.peaks(intervals_s) - 1.0, 0.0).sum(axis=(0, 2, 3))
        return np.asarray(intervals_s.sum(axis=1) + _PENALTY * excess)

    def stretched(self, intervals_s: Array) -> Array:
        """Motion time when X is stretched or shrunk until it just keeps the limits, (N,) for X (N, m)."""
        return np.asarray(intervals_s.sum(axis=1) * self.stretch(intervals_s))

    def stretch(self, intervals_s: Array) -> Array:
        """The factor on X that brings it just within the limits, as far as the grid sees: (N,)."""
        return stretch_of(self.peaks(intervals_s).max(axis=(2, 3)))


def stretch_of(ratios: Array) -> Array:
    """Least factor on time that brings ``ratios`` (3, ...) of speed, acceleration and jerk down to 1."""
    return np.asarray(np.maximum(np.maximum(ratios[0], np.sqrt(ratios[1])), np.cbrt(ratios[2])))


def _on_grid(pieces: Array, u: Array) -> Array:
    """Values (m * G, J) of polynomials (m, k + 1, J) at each u of (G,)."""
    powers = u[:, None] ** np.arange(pieces.shape[1])
    return np.asarray(np.einsum("gp,mpj->mgj", powers, pieces)).reshape(-1, pieces.shape[2])


def _time_maps(count: int, degree: int, u: Array) -> Array:
    """From intervals to t', t'', t''' on the grid, side by side: (m, 3 * m * G)."""
    pieces = spline.polynomials(np.ascontiguousarray(timeaxis.step_map(count, degree).T), degree)
    return np.hstack([_on_grid(spline.derivative(pieces, order), u).T for order in (1, 2, 3)])
