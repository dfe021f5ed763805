"""Cuckoo search: X.-S. Yang and S. Deb, "Cuckoo search via Lévy flights", NaBIC 2009, pp. 210-214.

Details as in the first author's program in "Nature-Inspired Metaheuristic Algorithms" (2nd edition, Luniver
2010): steps are scaled by the distance to the best nest, a new egg competes with the nest it came from, and
abandoned coordinates move along the difference of two other nests.
"""

from __future__ import annotations

import math

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.optimise.task import Number, Parameter, Result, Task, Tracker

BETA = Number(1.5, 0.3, 1.99, "index of the Lévy distribution, Eq. (23)")
"""The range is Mantegna's for his method (Physical Review E 49 (5),
1994, pp. 4677-4683)."""

PARAMETERS: dict[str, Parameter] = {
    "alpha": Number(0.01, 0.0, 100.0, "scale of the flights"),
    "pa": Number(0.25, 0.0, 1.0, "probability of a variable to be abandoned"),
    "beta": BETA,
}


def search(task: Task, *, alpha: float, pa: float, beta: float) -> Result:
    """Minimise with N evaluations of Lévy flights and at most N of new nests per iteration.

    ``alpha`` scales the flights, ``pa`` is the probability that a coordinate is abandoned, ``beta`` the index of
    the Lévy distribution. A nest without an abandoned coordinate is not evaluated again.
    """
    rng, tracker = task.rng, Tracker(task)
    low, high = task.bounds.T
    nests = rng.uniform(low, high, (task.population, len(low)))
    values = tracker.evaluate(nests)
    tracker.iteration_done()
    for _ in range(task.iterations):
        flights = alpha * levy_steps(rng, nests.shape, beta) * rng.standard_normal(nests.shape)
        eggs = np.clip(nests + flights * (nests - tracker.x), low, high)
        _keep_better(nests, values, eggs, tracker.evaluate(eggs), np.arange(task.population))
        eggs, changed = _new_nests(nests, rng, pa)
        eggs = np.clip(eggs, low, high)
        if changed.size:
            _keep_better(nests, values, eggs, tracker.evaluate(eggs), changed)
        tracker.iteration_done()
    return tracker.result()


def _new_nests(nests: Array, rng: np.random.Generator, pa: float) -> tuple[Array, np.ndarray]:
    """New nests (K, d) for those with an abandoned coordinate, and their indices (K,)."""
    abandoned = rng.random(nests.shape) < pa
    difference = nests[rng.permutation(len(nests))] - nests[rng.permutation(len(nests))]
    eggs = nests + rng.random() * difference * abandoned
    changed = np.flatnonzero(abandoned.any(axis=1))
    return eggs[changed], changed


def _keep_better(nests: Array, values: Array, eggs: Array, egg_values: Array, index: np.ndarray) -> None:
    """Replace nest ``index[k]`` by egg ``k`` of (K, d) if it is better, in place."""
    better = egg_values < values[index]
    nests[index[better]] = eggs[better]
    values[index[better]] = egg_values[better]


def levy_steps(rng: np.random.Generator, shape: tuple[int, ...], beta: float) -> Array:
    """Symmetric Lévy-stable steps of index ``beta``, within BETA, by Mantegna's method, Eq. (23)."""
    steps: Array = levy_scale(beta) * rng.standard_normal(shape)
    steps /= np.abs(rng.standard_normal(shape)) ** (1.0 / beta)
    return steps


def levy_scale(beta: float) -> float:
    """The factor of Gamma functions in Eq. (23), with the brackets of its source (Mantegna)."""
    top = math.gamma(1.0 + beta) * math.sin(math.pi * beta / 2.0)
    bottom = math.gamma((1.0 + beta) / 2.0) * beta * 2.0 ** ((beta - 1.0) / 2.0)
    return float((top / bottom) ** (1.0 / beta))
