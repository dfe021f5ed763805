"""The improved adaptive genetic algorithm: M. Srinivas and L. M. Patnaik, "Adaptive probabilities of
crossover and mutation in genetic algorithms", IEEE Transactions on Systems, Man and Cybernetics 24 (4),
1994, pp. 656-667. Good individuals are kept together, poor ones are broken up; the fitness in its formulas is
the merit by rank here. The paper does not say which improvement it means; this is the one others build on.
"""

from __future__ import annotations

import numpy as np

from armtempo.optimise.genes import crossover, decode, merits, mutate, random_bits, roulette
from armtempo.optimise.tracker import Array, Function, Progress, Result, Tracker

PARAMETERS: dict[str, float | str | bool] = {
    "bits": 16,
    "k1": 1.0,
    "k2": 0.5,
    "k3": 1.0,
    "k4": 0.5,
    "least_mutation": 0.005,
}


def search(
    function: Function,
    bounds: Array,
    rng: np.random.Generator,
    population: int,
    iterations: int,
    progress: Progress | None = None,
    *,
    bits: float = 16,
    k1: float = 1.0,
    k2: float = 0.5,
    k3: float = 1.0,
    k4: float = 0.5,
    least_mutation: float = 0.005,
) -> Result:
    """Minimises ``function`` by N evaluations an iteration.

    ``k1`` and ``k3`` scale the chance of crossover above and below the mean fitness, ``k2`` and ``k4``
    that of mutation; ``least_mutation`` is added to the latter for everybody (section IV of the source).
    """
    tracker = Tracker(function, iterations, progress)
    genes = random_bits(rng, population, len(bounds), int(bits))
    values = tracker.evaluate(decode(genes, bounds))
    tracker.iteration_done()
    for _ in range(iterations):
        merit = merits(values)
        chosen = roulette(merit, rng)
        rate = np.minimum(adaptive_rate(merit[chosen], merit, k2, k4) + least_mutation, 1.0)
        pairs = merit[chosen][: population // 2 * 2].reshape(-1, 2).max(axis=1)
        children = crossover(genes[chosen], rng, adaptive_rate(pairs, merit, k1, k3))
        genes = mutate(children, rng, rate)
        values = tracker.evaluate(decode(genes, bounds))
        tracker.iteration_done()
    return tracker.result()


def adaptive_rate(merit: Array, everybody: Array, above: float, below: float) -> Array:
    """Chances for individuals of ``merit`` (K,) within a population of merits ``everybody`` (N,).

    ``below`` up to the mean; from there ``above``, falling to 0 at the best.
    """
    best, mean = everybody.max(), everybody.mean()
    return np.where(merit < mean, below, above * (best - merit) / (best - mean))
