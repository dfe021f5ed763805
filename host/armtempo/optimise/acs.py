"""Adaptive cuckoo search, Eqs. (22) to (25) of the paper; first form, see ``search``."""

from __future__ import annotations

import math

import numpy as np

from armtempo.optimise.tracker import Array, Function, Progress, Result, Tracker

PARAMETERS: dict[str, float | str | bool] = {"a": 0.7, "b": 0.5, "pa": 0.25, "beta": 1.5}


def search(
    function: Function,
    bounds: Array,
    rng: np.random.Generator,
    population: int,
    iterations: int,
    progress: Progress | None = None,
    *,
    a: float = 0.7,
    b: float = 0.5,
    pa: float = 0.25,
    beta: float = 1.5,
) -> Result:
    """Minimises ``function`` by at most 2 N evaluations an iteration (section 3.2)."""
    low, high = bounds.T
    tracker = Tracker(function, iterations, progress)
    nests = rng.uniform(low, high, (population, len(low)))
    values = tracker.evaluate(nests)
    tracker.iteration_done()
    scale = levy_scale(beta)
    for t in range(1, iterations + 1):
        alpha = 0.01 * a * population**b * math.exp(-t * min(values.mean(), 50.0) / iterations)
        steps = (
            rng.standard_normal(nests.shape) * scale / np.abs(rng.standard_normal(nests.shape)) ** (1 / beta)
        )
        trial = np.clip(nests + alpha * steps * (nests - tracker.x), low, high)
        trial_values = tracker.evaluate(trial)
        better = trial_values < values
        nests[better], values[better] = trial[better], trial_values[better]
        first, second = rng.permutation(population), rng.permutation(population)
        moved = rng.random(nests.shape) < pa
        trial = np.clip(
            nests + moved * rng.random((population, 1)) * (nests[first] - nests[second]), low, high
        )
        trial_values = tracker.evaluate(trial)
        better = trial_values < values
        nests[better], values[better] = trial[better], trial_values[better]
        tracker.iteration_done()
    return tracker.result()


def levy_scale(beta: float) -> float:
    """The factor of Gamma functions in the Lévy step of Eq. (23)."""
    top = math.gamma(1 + beta) * math.sin(math.pi * beta / 2)
    return float((top / (math.gamma((1 + beta) / 2) * beta * 2 ** ((beta - 1) / 2))) ** (1 / beta))
