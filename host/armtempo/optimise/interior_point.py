"""A feasible primal-dual interior-point method for smooth programs with banded matrices.

    minimise f(x)    with    A x = b,    g(x) > 0

Every iterate is strictly feasible by the barrier -mu sum(log g), with mu decreasing to 0. The matrix of Newton's
step is the Hessian of f plus J' diag(multipliers / g) J, which is positive semidefinite, minus the second
derivatives of g if they help. If a step ends early at a curved boundary, a second-order correction from the same
matrix follows it. (Nocedal and Wright, Numerical Optimization, 2nd ed., chapters 18.3 and 19.)
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.progress import alive
from armtempo.optimise.kkt import Equalities


class Linearised(Protocol):
    """First and second derivatives of a program at one point."""

    gradient: Array
    """Gradient of f: (n,)."""

    def forward(self, step: Array) -> Array:
        """J times a step (n,): (M,)."""

    def backward(self, weights: Array) -> Array:
        """J' times ``weights`` (M,): (n,)."""

    def hessian(self, weights: Array, multipliers: Array, exact: bool) -> Array:
        """Entries, at the positions of the program's matrix, of the Hessian of f + J' diag(weights) J.

        Minus the second derivatives of g times ``multipliers`` (M,): all of them if ``exact``, else a positive
        semidefinite part.
        """


class Factorised(Protocol):
    """See ``kkt.Factor``."""

    def solve(self, gradient: Array, residual: Array) -> Array: ...


class Kkt(Protocol):
    """See ``kkt.BandedKkt``."""

    def factor(self, entries: Array) -> Factorised: ...


class Program(Protocol):
    """The program to solve."""

    @property
    def kkt(self) -> Kkt: ...

    equalities: Equalities

    def objective(self, x: Array) -> float:
        """f."""

    def inequalities(self, x: Array) -> Array:
        """g: (M,), of order 1; entries that are not positive, or NaN, if x is infeasible."""

    def linearise(self, x: Array) -> Linearised:
        """Derivatives at a feasible x."""


@dataclass(frozen=True)
class Schedule:
    """Barriers and iterations. A barrier is the sum over all inequalities, about the distance of f from its optimum."""

    first_barrier: float = 1e-2
    last_barrier: float = 1e-6
    iterations: int = 200
    curvature: bool = True
    """Use second derivatives of g if they help."""


@dataclass(frozen=True, eq=False)
class Minimum:
    """Result of ``minimise``."""

    x: Array
    value: float
    multipliers: Array
    """Multipliers of the inequalities: (M,)."""
    iterations: int
    converged: bool
    """Whether it converged at the last barrier."""


_SHRINK = 0.25
_SUPERLINEAR = 1.3
"""The barrier is multiplied by the first, or raised to the second power if that is smaller."""
_TO_BOUNDARY = 0.99
_KEEP = 1e-3
"""Smallest fraction of an inequality's value that remains after a step."""
_ARMIJO = 1e-4
_NEAR_CENTRE, _DONE = 5.0, 0.1
"""The barrier is reduced, and the method ends, if Newton's decrement is below this times the barrier times the
square root of their number."""
_SPREAD = 1e4
"""Multipliers stay within this factor of barrier / g."""
_LEAST_STEP = 1e-10
_BENT = 0.5
"""Steps shorter than this are also tried with a second-order correction."""
_MOST_VIOLATED = -0.5
"""Violation up to which the second-order correction is computed."""


def minimise(program: Program, x: Array, settings: Schedule | None = None) -> Minimum:
    """Find the local optimum near ``x`` with feasible iterates.

    An infeasible ``x`` is returned unchanged, not converged.
    """
    return _Solver(program, x, settings or Schedule()).run()


@dataclass(frozen=True, eq=False)
class _Step:
    """A step: its length (0: none found), the new x and g, and the decrement of Newton's model."""

    length: float
    x: Array
    g: Array
    decrement: float = 0.0


class _Solver:
    def __init__(self, program: Program, x: Array, settings: Schedule) -> None:
        self.program, self.settings, self.x = program, settings, x
        self.g = program.inequalities(x)
        self.count = len(self.g)
        self.barrier = settings.first_barrier / self.count
        self.last = settings.last_barrier / self.count
        with np.errstate(divide="ignore", invalid="ignore"):
            self.multipliers = self.barrier / self.g
        self.exact = settings.curvature
        """Whether the next step first tries all second derivatives of g."""
        self.whole = False
        """Whether the last step had its full length."""

    def run(self) -> Minimum:
        if not np.all(self.g > 0.0):
            return self._solution(0, False)
        for number in range(1, self.settings.iterations + 1):
            alive()
            step = self._step()
            size = self.barrier * np.sqrt(self.count)
            if self.barrier <= self.last and (step.length == 0.0 or step.decrement < _DONE * size):
                return self._solution(number, True)
            if step.length == 0.0 or step.decrement < _NEAR_CENTRE * size or self.whole:
                lower = min(self.barrier * _SHRINK, self.barrier**_SUPERLINEAR)
                self.barrier = max(self.last, lower)
        return self._solution(self.settings.iterations, False)

    def _solution(self, iterations: int, converged: bool) -> Minimum:
        return Minimum(self.x, self.program.objective(self.x), self.multipliers, iterations, converged)

    def _step(self) -> _Step:
        """One step of variables and multipliers."""
        at = self.program.linearise(self.x)
        gradient = at.gradient - at.backward(self.barrier / self.g)
        for exact in (True, False) if self.exact else (False,):
            entries = at.hessian(self.multipliers / self.g, self.multipliers, exact)
            try:
                factor = self.program.kkt.factor(entries)
            except np.linalg.LinAlgError:
                continue
            step = factor.solve(gradient, self.program.equalities.residual(self.x))
            found = self._line_search(at, factor, gradient, step)
            if found.length > 0.0:
                self.exact = self.settings.curvature and (found.length >= _BENT or not exact)
                self._move(found, at.forward(step))
                return found
        self.exact = self.settings.curvature
        return _Step(0.0, self.x, self.g)

    def _line_search(self, at: Linearised, factor: Factorised, gradient: Array, step: Array) -> _Step:
        """The better of the straight step and, if that is short, the corrected one."""
        # not with @: BLAS starts threads for it from 10 000 elements on
        slope = float(np.sum(gradient * step))
        if not np.all(np.isfinite(step)) or slope >= 0.0:
            return _Step(0.0, self.x, self.g)
        change = at.forward(step)
        most = min(1.0, 1.0 / max(float(np.max(-change / self.g)), 1e-300) * _TO_BOUNDARY)
        straight = self._search(step, np.zeros_like(step), slope, most)
        if straight.length >= _BENT:
            return straight
        correction = self._second_order_correction(step, change)
        if correction is None:
            return straight
        weighted = at.backward(self.multipliers / self.g * correction)
        other = factor.solve(gradient + weighted, self.program.equalities.residual(self.x))
        bent = self._search(step, other - step, slope, 1.0)
        return bent if bent.length > straight.length else straight

    def _second_order_correction(self, step: Array, change: Array) -> Array | None:
        """Second-order change of the inequalities by a full step: (M,)."""
        length = 1.0
        while length > _KEEP:
            g = self.program.inequalities(self.x + length * step)
            if np.all(g > _MOST_VIOLATED):
                return np.asarray((g - self.g - length * change) / length**2)
            length *= 0.5
        return None

    def _search(self, step: Array, correction: Array, slope: float, length: float) -> _Step:
        """Backtracking on the barrier function along x + s step + s^2 correction, from s = ``length``."""
        start = self._merit(self.x, self.g)
        while length > _LEAST_STEP:
            x = self.x + length * step + length**2 * correction
            g = self.program.inequalities(x)
            if np.all(g > _KEEP * self.g):
                allowed = start + _ARMIJO * length * slope + 1e-14 * abs(start)
                if self._merit(x, g) <= allowed:
                    return _Step(length, x, g, -slope)
            length *= 0.5
        return _Step(0.0, self.x, self.g)

    def _merit(self, x: Array, g: Array) -> float:
        return self.program.objective(x) - self.barrier * float(np.log(g).sum())

    def _move(self, found: _Step, change: Array) -> None:
        """Take a step, with the corresponding step of the multipliers."""
        old = self.multipliers
        move = self.barrier / self.g - old - old / self.g * change
        falling = move < 0
        part = float(np.min(-_TO_BOUNDARY * old[falling] / move[falling], initial=1.0))
        self.x, self.g = found.x, found.g
        centre = self.barrier / self.g
        self.multipliers = np.clip(old + part * move, centre / _SPREAD, centre * _SPREAD)
        self.whole = found.length > 0.9 and part > 0.9
