"""A primal-dual interior-point method for smooth programs with banded matrices, whose iterates may be infeasible.

    minimise f(x)    with    A x = b,    g(x) = s > 0

The slacks s stay positive; g(x) meets them only in the end, so steps do not end at the curved boundaries of g. Each
iteration has one matrix, the Hessian of f plus J' diag(multipliers / s) J, for Mehrotra's predictor and corrector.
(Nocedal and Wright, Numerical Optimization, 2nd ed., chapters 16.6 and 19.3.) The second derivatives of g are left
out: a time-optimal motion is at as many limits as it has variables, where they do not count.

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

_FIRST_GAP = 1.0
"""Sum of slacks times multipliers at the start; f is of order 1."""
_LEAST_SLACK = 1e-2
"""Slack of a nonlinear inequality at the start, if it is smaller: a start at a limit would be held there."""
_TO_BOUNDARY = 0.99
_VIOLATED, _GROWN = 0.3, 2.0
"""A step may violate inequalities by the first, or by the second times what they were violated by before."""
_MOST_HALVINGS = 20
_STALLED = 0.9
"""At the last gap, it ends if a step does not reduce the violation to less than this fraction."""
_CORRECTED = 10.0
"""Largest change of a slack times its multiplier in the corrector, relative to their mean."""


@dataclass(frozen=True)
class Goal:
    """When to end."""

    gap: float = 1e-3
    """Sum of slacks times multipliers, about the distance of f from its optimum."""
    violation: float = 1e-4
    """Largest violation of an inequality."""
    iterations: int = 60


class _Step(NamedTuple):
    """A step of the variables, slacks and multipliers."""

    x: Array
    slack: Array
    multipliers: Array


def minimise(program: Program, x: Array, linear: NDArray[np.bool_], goal: Goal) -> Array:
    """The variables near the local optimum near ``x`` (n,); ``linear``: whether each inequality is, (M,).

    Inequalities that are not linear are met to about ``goal.violation``. ``x`` itself if it does not meet a linear
    one strictly.
    """
    g = program.inequalities(x)
    slack = np.where(linear, g, np.maximum(g, _LEAST_SLACK))
    if not np.all(slack > 0.0):
        return x
    count = len(g)
    multipliers = _FIRST_GAP / count / slack
    least = goal.gap / count
    violation = np.inf
    for _ in range(goal.iterations):
        alive()
        at = program.linearise(x)
        short = g - slack
        weights = multipliers / slack
        mean = float(np.mean(slack * multipliers))
        try:
            factor = program.kkt.factor(at.hessian(weights, multipliers, False))
        except np.linalg.LinAlgError:
            return x
        residual = program.equalities.residual(x)

        def step(products: Array | float) -> _Step:
            """Newton's step of x, slacks and multipliers towards these products of the latter two."""
            wanted = products / slack  # noqa: B023 - called before the next iteration only
            of_x = factor.solve(at.gradient - at.backward(wanted - weights * short), residual)  # noqa: B023
            of_slack = at.forward(of_x) + short  # noqa: B023
            return _Step(of_x, of_slack, wanted - multipliers - weights * of_slack)  # noqa: B023

        _, of_slack, of_multipliers = step(0.0)
        one, other = _most(slack, of_slack), _most(multipliers, of_multipliers)
        reached = float(np.mean((slack + one * of_slack) * (multipliers + other * of_multipliers)))
        target = max((reached / mean) ** 3 * mean, least)
        bent = np.clip(one * other * of_slack * of_multipliers, -_CORRECTED * mean, _CORRECTED * mean)
        of_x, of_slack, of_multipliers = step(target - bent)
        if not np.all(np.isfinite(of_x)):
            return x
        length = min(1.0, _TO_BOUNDARY * _most(slack, of_slack))
        before, allowed = violation, max(_GROWN * float(np.max(-short)), _VIOLATED)
        for _ in range(_MOST_HALVINGS):
            found = x + length * of_x
            g = program.inequalities(found)
            violation = float(np.max(slack + length * of_slack - g))
            if violation <= allowed:
                break
            length *= 0.5
        else:
            return x
        x, slack = found, np.maximum(slack + length * of_slack, g)
        multipliers = (
            multipliers + min(1.0, _TO_BOUNDARY * _most(multipliers, of_multipliers)) * of_multipliers
        )
        if mean <= 2.0 * least and (violation < goal.violation or violation > _STALLED * before):
            break
    return x


def _most(values: Array, change: Array) -> float:
    """The largest part of a change, at most 1, with which no value becomes negative."""
    return min(1.0, 1.0 / max(float(np.max(-change / values)), 1e-300))
