"""Adaptive cuckoo search, section 3.2 of the paper, Eqs. (22) to (25), and a variant that adapts more.

The two variants (reasons: host/docs/optimisers.md):

===================  ==================================  ===================================================
choice               ``variant = "paper"``               ``variant = "differences"`` (default)
===================  ==================================  ===================================================
length of a flight   alpha_A of Eq. (25), each variable  ``a`` times one Lévy number for the whole nest
its scale            the variables' own unit             difference of two other nests, which adapts size and
                                                         direction to the population; F_m is not used
abandoned            the worst ``pa`` of the nests,      each variable of each nest with probability ``pa``,
                     for a flight from where they were   for a move along the difference of two nests
evaluations          at most (1 + pa) N an iteration     at most 2 N an iteration
===================  ==================================  ===================================================
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from armtempo.basics.arrays import Array
from armtempo.optimise.cs import BETA, levy_scale
from armtempo.optimise.task import Number, OneOf, Parameter, Result, Task, Tracker


class Nests:
    """Points and their values; a new point replaces its nest if it is better."""

    def __init__(self, task: Task, a: float, b: float, pa: float, beta: float) -> None:
        self.tracker = Tracker(task)
        self.low, self.high = task.bounds.T
        self.rng = task.rng
        self.a, self.b, self.pa, self.beta = a, b, pa, beta
        self.size = task.population
        self.gamma = levy_scale(beta)
        self.x = self.rng.uniform(self.low, self.high, (self.size, len(self.low)))
        self.values = self.tracker.evaluate(self.x)
        self.tracker.iteration_done()

    def iterate(self, part: float) -> None:
        """One iteration (steps 2 and 3 of the paper); ``part``: fraction of all iterations then done."""
        raise NotImplementedError

    def levy(self, shape: tuple[int, ...]) -> Array:
        """Lévy numbers, Eq. (23)."""
        tail = np.abs(self.rng.standard_normal(shape)) ** (1 / self.beta)
        return np.asarray(self.rng.standard_normal(shape) * self.gamma / tail)

    def settle(self, trial: Array, which: NDArray[np.intp] | slice = slice(None)) -> None:
        """Evaluate ``trial`` (K, d), clipped to the bounds; better ones replace their nests ``which`` (K,)."""
        trial = np.minimum(np.maximum(trial, self.low), self.high)
        values = self.tracker.evaluate(trial)
        better = values < self.values[which]
        self.x[which] = np.where(better[:, None], trial, self.x[which])
        self.values[which] = np.where(better, values, self.values[which])


class Paper(Nests):
    """The search of the paper."""

    def iterate(self, part: float) -> None:
        """Flights of all nests, then of the worst ones again; alpha_A from Eq. (25)."""
        alpha = self.a * self.size**self.b * math.exp(-part * min(float(self.values.mean()), 700.0))
        self.settle(self.x + alpha * self.levy(self.x.shape))
        worst = np.argsort(self.values)[self.size - math.floor(self.pa * self.size) :]
        if worst.size:
            self.settle(self.x[worst] + alpha * self.levy((worst.size, len(self.low))), worst)
        self.tracker.iteration_done()


class Differences(Nests):
    """The search whose steps are scaled by differences of nests."""

    def iterate(self, part: float) -> None:
        """A flight of each nest, then a move of some of its variables."""
        self.settle(self.x + self.a * self.levy((self.size, 1)) * self.difference())
        abandoned = self.rng.random(self.x.shape) < self.pa
        moved = self.x + abandoned * self.rng.random((self.size, 1)) * self.difference()
        if part < 1:  # omitted in the last iteration, for the evaluations of the first population
            self.settle(moved)
        self.tracker.iteration_done()

    def difference(self) -> Array:
        """For each nest the difference of two nests drawn at random."""
        permutation = self.rng.permutation
        return np.asarray(self.x[permutation(self.size)] - self.x[permutation(self.size)])


VARIANTS: dict[str, type[Nests]] = {"differences": Differences, "paper": Paper}

PARAMETERS: dict[str, Parameter] = {
    "a": Number(0.7, 0.0, 100.0, "of Eq. (25)"),
    "b": Number(0.5, -5.0, 5.0, "of Eq. (25)"),
    "pa": Number(0.25, 0.001, 1.0, "fraction of the nests, or probability of a variable, to be abandoned"),
    "beta": BETA,
    "variant": OneOf("differences", tuple(VARIANTS), "see [below](#choices-in-the-adaptive-cuckoo-search)"),
}


def search(task: Task, *, a: float, b: float, pa: float, beta: float, variant: str) -> Result:
    """Minimise with the evaluations of the table above, and N for the first population.

    ``a``, ``b`` of Eq. (25), ``pa`` the fraction abandoned, ``beta`` of Eq. (23). The variant "differences" saves
    the evaluations of its first population in the last iteration: 2 N for each iteration in total.
    """
    nests = VARIANTS[variant](task, a, b, pa, beta)
    for iteration in range(1, task.iterations + 1):
        nests.iterate(iteration / task.iterations)
    return nests.tracker.result()
