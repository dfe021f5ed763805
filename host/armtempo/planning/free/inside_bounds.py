"""The path of one joint nearest to a given one, with a margin to its bounds."""

from __future__ import annotations

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.optimise import interior_point
from armtempo.optimise.interior_point import Linearised, Schedule
from armtempo.optimise.kkt import BandedKkt, Equalities
from armtempo.planning.free.angle_bounds import Forms
from armtempo.planning.linear_rows import LinearRows

_CENTRE = Schedule(first_barrier=1e3, last_barrier=1e3, iterations=30, curvature=False)
"""Settings that prefer a large margin over similarity."""
_NEAR = Schedule(first_barrier=10.0, last_barrier=1e-10, curvature=False)
_OFF = Schedule(first_barrier=10.0, last_barrier=1e-3, curvature=False)
_TOO_NEAR = 1e-9
"""A path closer to a bound than this (in the unit of the angles) is moved farther away, even if it becomes
less similar: otherwise Newton's equations of the following solve lose all digits."""
_WIDER = 2.0
"""Bounds are widened by this factor times the path's excess."""
_BETTER, _STEPS = 0.99, 60
_ROOM, _MOST_ROOM = 0.25, 1e-7
"""Margin to the bounds: fraction of the room, and largest value in the unit of the angles."""


def nearest(forms: Forms, room: float, fixed: Equalities, wanted: Array) -> Array | None:
    """Control points (C,) that meet ``fixed``, keep each form within its bounds, and are nearest to ``wanted`` (C,).

    The distance is the sum of squared third differences. The bounds are first widened until ``wanted``, which
    meets ``fixed``, keeps them, and then narrowed again around their middle until the path keeps a margin, a
    fraction of ``room``, which is the distance of the fixed values from the bounds. None if that is not
    possible.
    """
    x, room = wanted, min(_ROOM * room, _MOST_ROOM)
    excess = _excess(forms, x) + room
    for _ in range(_STEPS):
        if excess <= 0.5 * room:
            break
        program = _Alike(forms, _WIDER * excess - room, fixed, wanted)
        x = interior_point.minimise(program, x, _CENTRE).x
        before, excess = excess, _excess(forms, x) + room
        if not excess < _BETTER * before:
            return None
    program = _Alike(forms, 0.0, fixed, wanted)
    found = interior_point.minimise(program, x, _NEAR)
    if found.iterations and _excess(forms, found.x) > -_TOO_NEAR:
        found = interior_point.minimise(program, x, _OFF)
    return found.x if found.iterations else None


def _excess(forms: Forms, x: Array) -> float:
    """Largest excess of a form over its bounds; negative if all are inside."""
    sums = np.sum(forms.weights * x[forms.columns], axis=1)
    return float(np.max(np.maximum(forms.low - sums, sums - forms.high)))


class _Alike:
    """The program: relative squared third differences from ``wanted``, within widened bounds."""

    def __init__(self, forms: Forms, wider: float, equalities: Equalities, wanted: Array) -> None:
        self.equalities, self._wanted = equalities, wanted
        count = len(wanted)
        bounds = LinearRows(count, forms.columns, forms.weights, forms.low - wider, forms.high + wider)
        self._bounds = bounds
        self._scale = 1.0 / max(float(np.sum(np.diff(wanted, 3) ** 2)), 1e-300)
        self._third = LinearRows(
            count,
            np.arange(count - 3)[:, None] + np.arange(4),
            np.broadcast_to([-1.0, 3.0, -3.0, 1.0], (count - 3, 4)),
            np.full(count - 3, -np.inf),
            np.zeros(count - 3),
        )
        self.kkt = BandedKkt(
            np.arange(count, dtype=float),
            np.concatenate([self._third.rows, bounds.rows]),
            np.concatenate([self._third.columns, bounds.columns]),
            equalities,
        )

    def objective(self, x: Array) -> float:
        return 0.5 * self._scale * float(np.sum(self._third.values(x - self._wanted) ** 2))

    def inequalities(self, x: Array) -> Array:
        return self._bounds.values(x)

    def linearise(self, x: Array) -> Linearised:
        third = self._third.values(x - self._wanted)
        return _Linearised(self._bounds, self._third, self._scale, self._third.backward(self._scale * third))


class _Linearised:
    def __init__(self, bounds: LinearRows, third: LinearRows, scale: float, gradient: Array) -> None:
        self.gradient, self._bounds, self._third, self._scale = gradient, bounds, third, scale

    def forward(self, step: Array) -> Array:
        return self._bounds.forward(step)

    def backward(self, weights: Array) -> Array:
        return self._bounds.backward(weights)

    def hessian(self, weights: Array, multipliers: Array, exact: bool) -> Array:
        smooth = self._third.hessian(np.full(self._third.count, self._scale), multipliers, exact)
        return np.concatenate([smooth, self._bounds.hessian(weights, multipliers, exact)])
