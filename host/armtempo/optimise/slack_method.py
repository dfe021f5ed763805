"""A primal-dual interior-point method for smooth programs with banded matrices, whose iterates may be infeasible.

    minimise f(x)    with    A x = b,    g(x) = s > 0

The slacks s stay positive; g(x) meets them only in the end, so steps do not end at the curved boundaries of g. Each
iteration has one matrix, the Hessian of f plus J' diag(multipliers / s) J, for Mehrotra's predictor and corrector, and
for Gondzio's corrections, which keep the products of slacks and multipliers alike so that steps are long. (Nocedal and
Wright, Numerical Optimization, 2nd ed., chapters 16.6 and 19.3; Gondzio, Multiple centrality corrections, 1996.) The
second derivatives of g are left out: a time-optimal motion is at as many limits as it has variables, where they do not
count.

Inequalities that are linear, and met at the start, are met by every iterate.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from armtempo.basics.arrays import Array
from armtempo.basics.progress import alive
from armtempo.optimise.interior_point import Program

_TO_BOUNDARY = 0.99
_VIOLATED, _GROWN = 0.3, 2.0
"""A step may violate inequalities by the first, or by the second times what they were violated by before."""
_MOST_HALVINGS = 20
_STALLED = 0.9
"""At the last gap, it ends if a step does not reduce the violation to less than this fraction."""
_CORRECTED = 10.0
"""Largest change of a slack times its multiplier in the corrector, relative to their mean."""
_CORRECTIONS = 2
"""Most corrections for longer steps in one iteration, each with the same matrix."""
_LONG = 0.9
"""Steps of this length are not corrected."""
_LONGER, _LONGER_BY = 1.2, 0.1
"""A correction is for a step this many times as long, and longer by this."""
_WORTHWHILE = 0.02
"""A correction that does not lengthen the steps, of slacks and multipliers together, by this much is the last."""
_LARGER = 3.0
"""Corrections that make the step of the variables this many times as large are not used."""
_ALIKE = 10.0
"""Factor from the wanted product of a slack and its multiplier within which corrections leave it."""


@dataclass(frozen=True)
class Goal:
    """Where to start and when to end."""

    gap: float = 1e-3
    """Sum of slacks times multipliers, about the distance of f from its optimum."""
    violation: float = 1e-4
    """Largest violation of an inequality."""
    first_gap: float = 1.0
    """Sum of slacks times multipliers at the start; f is of order 1."""
    least_slack: float = 1e-2
    """Slack of a nonlinear inequality at the start, if it is smaller: a start at a limit would be held there."""
    iterations: int = 60


class LocalOptimum(NamedTuple):
    """Variables (n,) and multipliers of the inequalities (M,)."""

    x: Array
    multipliers: Array


class _Step(NamedTuple):
    """A step of the variables, slacks and multipliers."""

    x: Array
    slack: Array
    multipliers: Array


class _Corrected(NamedTuple):
    """A step, and the parts of it that the slacks and the multipliers allow."""

    step: _Step
    of_slacks: float
    of_multipliers: float


class _Newton:
    """Newton's equations at one iterate."""

    def __init__(self, program: Program, x: Array, short: Array, slack: Array, multipliers: Array) -> None:
        """``short``: g(x) - slack; raises numpy's LinAlgError if the matrix is singular."""
        self._at = program.linearise(x)
        self._short, self._slack, self._multipliers = short, slack, multipliers
        self._weights = multipliers / slack
        self._factor = program.kkt.factor(self._at.hessian(self._weights, multipliers, False))
        self._residual = program.equalities.residual(x)

    def step(self, products: Array | float) -> _Step:
        """Towards these products of slacks and multipliers."""
        wanted = products / self._slack
        pull = self._at.gradient - self._at.backward(wanted - self._weights * self._short)
        of_x = self._factor.solve(pull, self._residual)
        of_slack = self._at.forward(of_x) + self._short
        return _Step(of_x, of_slack, wanted - self._multipliers - self._weights * of_slack)

    def lengths(self, step: _Step) -> tuple[float, float]:
        """The parts of the step with which no slack, and no multiplier, becomes negative; at most 1."""
        return _most(self._slack, step.slack), _most(self._multipliers, step.multipliers)

    def predicted(self, least: float) -> tuple[float, Array]:
        """Product to aim at, by how far an uncorrected step would get, at least ``least``, and second-order change."""
        step, mean = self.step(0.0), float(np.mean(self._slack * self._multipliers))
        one, other = self.lengths(step)
        reached = (self._slack + one * step.slack) * (self._multipliers + other * step.multipliers)
        target = max(min(float(np.mean(reached)) / mean, 1.0) ** 3 * mean, least)
        bent = one * other * step.slack * step.multipliers
        return target, np.clip(bent, -_CORRECTED * mean, _CORRECTED * mean)

    def corrected(self, target: float, bent: Array) -> _Corrected:
        """The step towards products of ``target``."""
        products = target - bent
        step = self.step(products)
        one, other = self.lengths(step)
        for _ in range(_CORRECTIONS):
            if min(one, other) > _LONG:
                break
            far, beyond = (min(1.0, _LONGER * each + _LONGER_BY) for each in (one, other))
            reached = (self._slack + far * step.slack) * (self._multipliers + beyond * step.multipliers)
            change = np.clip(reached, target / _ALIKE, target * _ALIKE) - reached
            tried = products + np.maximum(change, -_ALIKE * target)
            longer = self.step(tried)
            lengths = self.lengths(longer)
            large = np.abs(longer.x).max() > _LARGER * np.abs(step.x).max()  # the matrix is nearly singular
            if large or sum(lengths) < one + other + _WORTHWHILE:
                break
            step, products, (one, other) = longer, tried, lengths
        return _Corrected(step, one, other)


def minimise(
    program: Program, x: Array, linear: NDArray[np.bool_], goal: Goal, multipliers: Array | None = None
) -> LocalOptimum:
    """The variables near the local optimum near ``x`` (n,); ``linear``: whether each inequality is, (M,).

    Inequalities that are not linear are met to about ``goal.violation``. ``multipliers``: (M,) of a similar program
    for a quicker start, NaN where unknown. ``x`` itself if it does not meet a linear one strictly.
    """
    g = program.inequalities(x)
    slack = np.where(linear, g, np.maximum(g, goal.least_slack))
    count = len(g)
    least = goal.gap / count
    known = np.full(count, np.nan) if multipliers is None else multipliers
    if not np.all(slack > 0.0):
        return LocalOptimum(x, known)
    first = goal.first_gap / count
    slack = np.where(linear | np.isnan(known), slack, np.maximum(g, np.minimum(first / known, slack)))
    centre = first / slack
    multipliers = np.where(np.isnan(known), centre, np.clip(known, centre / _ALIKE, centre * _ALIKE))
    violation = np.inf
    for _ in range(goal.iterations):
        alive()
        short, mean = g - slack, float(np.mean(slack * multipliers))
        try:
            newton = _Newton(program, x, short, slack, multipliers)
        except np.linalg.LinAlgError:
            break
        step, one, other = newton.corrected(*newton.predicted(least))
        if not np.all(np.isfinite(step.x)):
            break
        length = min(1.0, _TO_BOUNDARY * one)
        before, allowed = violation, max(_GROWN * float(np.max(-short)), _VIOLATED)
        for _ in range(_MOST_HALVINGS):
            found = x + length * step.x
            g = program.inequalities(found)
            violation = float(np.max(slack + length * step.slack - g))
            if violation <= allowed:
                break
            length *= 0.5
        else:
            break
        x, slack = found, np.maximum(slack + length * step.slack, g)
        multipliers = multipliers + min(1.0, _TO_BOUNDARY * other) * step.multipliers
        if mean <= 2.0 * least and (violation < goal.violation or violation > _STALLED * before):
            break
    return LocalOptimum(x, multipliers)


def _most(values: Array, change: Array) -> float:
    """The largest part of a change, at most 1, with which no value becomes negative."""
    return min(1.0, 1.0 / max(float(np.max(-change / values)), 1e-300))
