"""Gradient solvers for the time axis: from a good one to the best one nearby.

``descend`` takes linear programs within a trust region: big steps, every iterate keeps the limits.
``finish`` solves the smooth problem on a finite set of rows (SLSQP), adds the peaks that its solution shows
between them, and repeats; the optimum on the set bounds the true one from below, the stretched solution from
above.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np

from armtempo.planning.constraints import Constraints, Path, Rows, near_rows, peak_rows
from armtempo.splines.bspline import Array

GAP = 1e-8
"""``finish`` ends where bounds from above and below agree to this."""

_ROUNDS = 16
_INNER_ROUNDS = 4
_TURNS = 8
_WORTH = 1e-4
_DESCENTS = 60
_SLACK = 0.3
_PEAK_SLACK = 0.1
_BOX = 0.3
_SLSQP_MOST = 160
"""Variables beyond which SLSQP takes minutes; ``descend`` alone serves there."""


@dataclass(frozen=True, eq=False)
class Polished:
    """A local optimum: variables (v,), their motion time, and the bound from below near them."""

    y: Array
    total_s: float
    bound_s: float


def polish(path: Path, y: Array, gap: float = GAP) -> Polished:
    """The local optimum near ``y`` (v,), to ``gap`` if it can; never worse than ``y`` stretched."""
    found = improve(path, y)
    if len(y) > _SLSQP_MOST or found.total_s <= found.bound_s * (1 + gap):
        return found
    return finish(path, found.y)


def improve(path: Path, y: Array) -> Polished:
    """Both solvers in turn, each going on where the other gets stuck, while that pays.

    Mostly to within 1e-4 of the local optimum; keeps the limits.
    """
    y, bound = path.stretched(y), 0.0
    for _ in range(_TURNS):
        before = path.duration_s(y)
        y = descend(path, y)
        if len(y) <= _SLSQP_MOST:
            found = finish(path, y, _INNER_ROUNDS)
            y, bound = found.y, found.bound_s
        if path.duration_s(y) > before * (1 - _WORTH):
            break
    return Polished(y, path.duration_s(y), bound)


def descend(path: Path, y: Array) -> Array:
    """Linear programs in a trust region until they bring less than 1e-7 of the motion time.

    ``y`` must keep the limits. So does the result.
    """
    parts = _parts(path)
    radius, total = 0.2, path.duration_s(y)
    for _ in range(_DESCENTS):
        rows = near_rows(path, y, parts, max(0.3, 2 * radius)) + peak_rows(path, y, parts, 0.3)
        constraints = Constraints(path, rows, y)
        better, radius, promised = _step(path, constraints, y, radius)
        if better is None:
            break
        gain = total - path.duration_s(better)
        y, total = better, total - gain
        if gain < 1e-7 * total:
            break
        part = gain / promised
        radius = min(0.5, 2 * radius) if part > 0.7 else radius if part > 0.3 else radius / 2
    return y


def _step(path: Path, constraints: Constraints, y: Array, radius: float) -> tuple[Array | None, float, float]:
    """A better point, the radius in which it was found, and the gain that the linear model promised."""
    from scipy.optimize import linprog

    slope, room = -constraints.gradient(y), np.maximum(constraints.values(y), 0.0)
    total = path.duration_s(y)
    while radius > 1e-7:
        bounds = np.stack([-radius * y, radius * y], axis=1)
        found = linprog(path.weights, A_ub=slope, b_ub=room, bounds=bounds, method="highs-ds")
        if found.x is not None:
            better = path.stretched(y + found.x)
            if path.duration_s(better) < total:
                return better, radius, -float(found.fun)
        radius /= 3
    return None, radius, 0.0


def finish(path: Path, y: Array, rounds: int = _ROUNDS) -> Polished:
    """SLSQP on growing sets of rows, from ``y`` that keeps the limits."""
    parts = _parts(path)
    best, total, bound = y, path.duration_s(y), 0.0
    peaks = peak_rows(path, y, 2 * parts, _PEAK_SLACK)
    box = _BOX
    for _ in range(rounds):
        y, relaxed, done = _solve(path, near_rows(path, y, parts, _SLACK) + peaks, y, box)
        feasible = path.stretched(y)
        reached = path.duration_s(feasible)
        if reached < total:
            best, total = feasible, reached
        if done:
            bound = relaxed
        if total <= relaxed * (1 + GAP) and done:
            break
        if reached > 1.2 * total:
            y, box = best, box / 3
        peaks = peaks + peak_rows(path, y, 4 * parts, _PEAK_SLACK)
    return Polished(best, total, min(bound, total))


def _solve(path: Path, rows: Rows, y: Array, box: float) -> tuple[Array, float, bool]:
    """SLSQP on these rows within a box around ``y``: its point, motion time, and whether it is optimal.

    At a wall of the box it is not: beyond may be better, so it would be no bound from below.
    """
    from scipy.optimize import minimize

    constraints = Constraints(path, rows, y)
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        found = minimize(
            path.duration_s,
            y,
            jac=lambda _: path.weights,
            constraints={"type": "ineq", "fun": constraints.values, "jac": constraints.gradient},
            bounds=np.stack([y * (1 - box), y * (1 + box)], axis=1),
            method="SLSQP",
            options={"maxiter": 100, "ftol": 1e-14},
        )
    if not np.all(np.isfinite(found.x)) or np.any(found.x <= 0):
        return y, path.duration_s(y), False
    inside = bool(np.all(np.abs(found.x - y) < box * y * (1 - 1e-9)))
    return found.x, float(found.fun), inside and found.status in (0, 8)


def _parts(path: Path) -> int:
    """Grid parts in a time segment: fewer where a path segment has many."""
    return 8 if path.segments < 12 else 4
