"""Fastest time law along a path under speed and acceleration limits alone: a lower bound for any jerk limit.

Reachability analysis (Pham and Pham, IEEE T-RO 34(3), 2018) on a grid: backwards the highest path speed from
which the end can still be reached, forwards the greatest path acceleration that stays below it.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from armtempo.splines import bspline
from armtempo.splines.bspline import Array

GRID = 400
"""Grid intervals of the coarser of two grids."""


def floor_s(angle_points_deg: Array, degree: int, speed_deg_s: Array, acceleration_deg_s2: Array) -> float:
    """Least motion time of the path with control points (n + degree, J).

    ``speed_deg_s`` and ``acceleration_deg_s2``: (J,). The error of a grid falls with its step, so that two
    grids give the limit (Richardson), here to about 1e-3 s.
    """
    coarse, fine = (
        _on_grid(angle_points_deg, degree, speed_deg_s, acceleration_deg_s2, grid)
        for grid in (GRID, 2 * GRID)
    )
    return 2 * fine - coarse


def _on_grid(points: Array, degree: int, speed_deg_s: Array, acceleration_deg_s2: Array, grid: int) -> float:
    first, second, step = _path(points, degree, grid)
    first, second = first / acceleration_deg_s2, second / acceleration_deg_s2
    top = _speed_limit(first * acceleration_deg_s2 / speed_deg_s)
    controllable = np.empty(grid + 1)
    controllable[-1] = min(top[-1], _fastest_here(second[-1]))
    for i in range(grid - 1, -1, -1):
        controllable[i] = min(top[i], _fastest_before(first[i], second[i], step, controllable[i + 1]))
    squared = np.empty(grid + 1)
    squared[0] = controllable[0]
    for i in range(grid):
        squared[i + 1] = _fastest_after(first[i], second[i], step, squared[i], controllable[i + 1])
    rate = np.sqrt(squared)
    return float(np.sum(2.0 * step / (rate[:-1] + rate[1:])))


def _path(points: Array, degree: int, grid: int) -> tuple[Array, Array, float]:
    """First and second derivative of the angles by s on an even grid of s, (grid + 1, J), and its step.

    u runs as a power of s at both ends, chosen so that the angle starts with s²: then a finite path speed
    is a start from standstill at finite acceleration.
    """
    pieces = bspline.polynomials(points, degree)
    ends = min(1.0, len(pieces) / 2)
    power = 2.0 / ((degree + 1) / 2)
    straight = (len(pieces) - 2 * ends) / power
    s = np.linspace(0.0, 2 * ends + straight, grid + 1)
    near = np.minimum(s, s[::-1])
    bent = np.maximum(near, 1e-9) / ends
    inside = near < ends
    u = np.where(inside, ends * bent**power, ends + power * (near - ends))
    slope = np.where(inside, power * bent ** (power - 1), power)
    curve = np.where(inside, power * (power - 1) / ends * bent ** (power - 2), 0.0)
    late = s > s[-1] / 2
    u, curve = np.where(late, len(pieces) - u, u), np.where(late, -curve, curve)
    segment = np.clip(u.astype(int), 0, len(pieces) - 1)

    def at(order: int) -> Array:
        derived = bspline.derivative(pieces, order)
        powers = (u - segment)[:, None] ** np.arange(derived.shape[1])
        return np.asarray(np.einsum("pc,pcj->pj", powers, derived[segment]))

    q1, q2 = at(1), at(2)
    first = q1 * slope[:, None]
    return first, q2 * slope[:, None] ** 2 + q1 * curve[:, None], float(s[1])


def _speed_limit(first: Array) -> Array:
    """Highest squared path speed that the speed limits allow: (G,)."""
    fastest = np.abs(first).max(axis=1)
    return np.asarray(1.0 / np.maximum(fastest, 1e-150) ** 2)


def _fastest_here(second: Array) -> float:
    """Highest squared path speed at a point where the path has no first derivative."""
    return float(1.0 / max(np.abs(second).max(), 1e-300))


def _fastest_before(first: Array, second: Array, step: float, after: float) -> float:
    """Highest squared path speed x from which some y in [0, ``after``] is reached one ``step`` on.

    With path acceleration (y - x) / 2 step each joint asks -1 <= a y + b x <= 1: the highest x is at a corner
    of that region.
    """
    a = first / (2.0 * step)
    b = second - a
    rows = np.concatenate([np.stack([a, b], axis=1), -np.stack([a, b], axis=1), [[1.0, 0.0], [-1.0, 0.0]]])
    right = np.concatenate([np.ones(2 * len(a)), [after, 0.0]])
    i, j = _pairs(len(rows))
    det = rows[i, 0] * rows[j, 1] - rows[j, 0] * rows[i, 1]
    with np.errstate(divide="ignore", invalid="ignore"):
        y = (right[i] * rows[j, 1] - right[j] * rows[i, 1]) / det
        x = (rows[i, 0] * right[j] - rows[j, 0] * right[i]) / det
        room = right[:, None] - rows[:, :1] * y - rows[:, 1:] * x
        inside = np.all(room >= -1e-9 * (1 + np.abs(right[:, None])), axis=0)
    return float(np.max(x, where=inside & np.isfinite(x), initial=0.0))


@cache
def _pairs(count: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    return np.triu_indices(count, 1)


def _fastest_after(first: Array, second: Array, step: float, now: float, most: float) -> float:
    """Highest squared path speed one ``step`` on, at most ``most``, from ``now``."""
    with np.errstate(divide="ignore"):
        push = np.where(first != 0, (1.0 - np.sign(first) * second * now) / np.abs(first), np.inf)
    return float(min(most, max(now + 2.0 * step * push.min(), 0.0)))
