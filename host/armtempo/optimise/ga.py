"""The standard genetic algorithm: J. H. Holland, "Adaptation in Natural and Artificial Systems",
University of Michigan Press 1975, in the form D. E. Goldberg gave it ("Genetic Algorithms in Search,
Optimization and Machine Learning", Addison-Wesley 1989, chapter 3): bit strings, roulette wheel (by rank),
one-point crossover, bit mutation, children replace their parents; nobody survives by privilege.
"""

from __future__ import annotations

import numpy as np

from armtempo.optimise.genes import crossover, decode, merits, mutate, random_bits, roulette
from armtempo.optimise.tracker import Array, Function, Progress, Result, Tracker

PARAMETERS: dict[str, float | str | bool] = {"bits": 16, "crossover_rate": 0.6, "mutation_rate": 0.01}


def search(
    function: Function,
    bounds: Array,
    rng: np.random.Generator,
    population: int,
    iterations: int,
    progress: Progress | None = None,
    *,
    bits: float = 16,
    crossover_rate: float = 0.6,
    mutation_rate: float = 0.01,
) -> Result:
    """Minimises ``function`` by N evaluations an iteration.

    ``bits`` code a variable, ``crossover_rate`` is the chance of a pair to be crossed,
    ``mutation_rate`` that of a bit to flip.
    """
    tracker = Tracker(function, iterations, progress)
    genes = random_bits(rng, population, len(bounds), int(bits))
    values = tracker.evaluate(decode(genes, bounds))
    tracker.iteration_done()
    for _ in range(iterations):
        parents = genes[roulette(merits(values), rng)]
        genes = mutate(crossover(parents, rng, crossover_rate), rng, mutation_rate)
        values = tracker.evaluate(decode(genes, bounds))
        tracker.iteration_done()
    return tracker.result()
