"""The improved adaptive genetic algorithm: M. Srinivas and L. M. Patnaik, "Adaptive probabilities of
crossover and mutation in genetic algorithms", IEEE Transactions on Systems, Man and Cybernetics 24 (4),
1994, pp. 656-667. Good individuals are changed less than poor ones; the fitness in its formulas is the merit by
rank here. The paper does not say which improved algorithm it means; this one is the best known.
"""

from __future__ import annotations

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.optimise.ga import BITS, crossover, decode, merits, mutate, random_bits, roulette
from armtempo.optimise.task import Number, Parameter, Result, Task, Tracker

PARAMETERS: dict[str, Parameter] = {
    "bits": BITS,
    "k1": Number(1.0, 0.0, 1.0, "probability of crossover above the mean"),
    "k2": Number(0.5, 0.0, 1.0, "probability of mutation above the mean"),
    "k3": Number(1.0, 0.0, 1.0, "probability of crossover below the mean"),
    "k4": Number(0.5, 0.0, 1.0, "probability of mutation below the mean"),
    "least_mutation": Number(0.005, 0.0, 1.0, "added to the probability of mutation of every individual"),
}


def search(
    task: Task, *, bits: int, k1: float, k2: float, k3: float, k4: float, least_mutation: float
) -> Result:
    """Minimise with N evaluations per iteration.

    ``k1`` and ``k3`` scale the probability of crossover above and below the mean fitness, ``k2`` and ``k4`` that of
    mutation; ``least_mutation`` is added to the latter for every individual (section IV of the source).
    """
    rng, tracker = task.rng, Tracker(task)
    genes = random_bits(rng, task.population, len(task.bounds), bits)
    values = tracker.evaluate(decode(genes, task.bounds))
    tracker.iteration_done()
    for _ in range(task.iterations):
        merit = merits(values)
        chosen = roulette(merit, rng)
        rate = np.minimum(adaptive_rate(merit[chosen], merit, k2, k4) + least_mutation, 1.0)
        pairs = merit[chosen][: task.population // 2 * 2].reshape(-1, 2).max(axis=1)
        children = crossover(genes[chosen], rng, adaptive_rate(pairs, merit, k1, k3))
        genes = mutate(children, rng, rate)
        values = tracker.evaluate(decode(genes, task.bounds))
        tracker.iteration_done()
    return tracker.result()


def adaptive_rate(merit: Array, everybody: Array, above: float, below: float) -> Array:
    """Probabilities for individuals of ``merit`` (K,) in a population of merits ``everybody`` (N,).

    ``below`` up to the mean; above it from ``above`` linearly to 0 at the best.
    """
    best, mean = everybody.max(), everybody.mean()
    return np.where(merit < mean, below, above * (best - merit) / (best - mean))
