"""The standard genetic algorithm: J. H. Holland, "Adaptation in Natural and Artificial Systems",
University of Michigan Press 1975, in the form D. E. Goldberg gave it ("Genetic Algorithms in Search,
Optimization and Machine Learning", Addison-Wesley 1989, chapter 3): bit strings, roulette wheel (by rank),
one-point crossover, bit mutation; children replace their parents, without elitism.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from armtempo.basics.arrays import Array
from armtempo.optimise.task import Number, Parameter, Result, Task, Tracker

Bits = NDArray[np.bool_]
"""A population (individuals, variables, bits), most significant bit first."""

BITS = Number(16, 2, 52, "bits that code a variable")
"""At most the 52 bits of a double's fraction."""
PARAMETERS: dict[str, Parameter] = {
    "bits": BITS,
    "crossover_rate": Number(0.6, 0.0, 1.0, "probability of a pair to be crossed"),
    "mutation_rate": Number(0.01, 0.0, 1.0, "probability of a bit to flip"),
}


def random_bits(rng: np.random.Generator, population: int, variables: int, bits: int) -> Bits:
    """A random population (population, variables, bits)."""
    return rng.random((population, variables, bits)) < 0.5


def decode(genes: Bits, bounds: Array) -> Array:
    """Points (N, d) of ``genes`` (N, d, bits), on a uniform grid over ``bounds`` (d, 2)."""
    weights = 0.5 ** np.arange(1, genes.shape[2] + 1)
    fraction = (genes @ weights) / weights.sum()
    low, high = bounds.T
    points: Array = low + np.minimum(fraction, 1.0) * (high - low)
    return np.clip(points, low, high)


def merits(values: Array) -> Array:
    """The merit that selection uses: from 2 for the smallest of the values (N,), by rank, to 0 for the largest.

    Linear ranking (J. E. Baker, "Adaptive selection methods for genetic algorithms", ICGA 1985, pp. 101-111):
    otherwise a few individuals far outside the limits would make the others indistinguishable.
    """
    rank = np.empty(len(values))
    rank[np.argsort(values)] = np.arange(len(values))
    return np.asarray(2.0 - 2.0 * rank / max(len(values) - 1, 1))


def roulette(merit: Array, rng: np.random.Generator) -> NDArray[np.intp]:
    """Indices (N,) of parents, drawn with probabilities proportional to ``merit`` (N,)."""
    return rng.choice(len(merit), size=len(merit), p=merit / merit.sum())


def crossover(parents: Bits, rng: np.random.Generator, probability: float | Array) -> Bits:
    """One-point crossover of parents 0 and 1, 2 and 3, …; ``probability``: a number or (N // 2,)."""
    count = len(parents) // 2
    children = parents.reshape(len(parents), -1).copy()
    first, second = children[0 : 2 * count : 2], children[1 : 2 * count : 2]
    length = children.shape[1]
    cut = rng.integers(1, length, count)
    crossing = rng.random(count) < probability
    swap = crossing[:, None] & (np.arange(length) >= cut[:, None])
    first[swap], second[swap] = second[swap], first[swap]
    return children.reshape(parents.shape)


def mutate(genes: Bits, rng: np.random.Generator, probability: float | Array) -> Bits:
    """Flip each bit of an individual with its ``probability``, a number or (N,)."""
    chance = np.asarray(probability, dtype=float).reshape(-1, 1, 1)
    flipped: Bits = genes ^ (rng.random(genes.shape) < chance)
    return flipped


def search(task: Task, *, bits: int, crossover_rate: float, mutation_rate: float) -> Result:
    """Minimise with N evaluations per iteration.

    ``bits`` per variable; ``crossover_rate``: probability of a pair to be crossed; ``mutation_rate``: of a bit to
    flip.
    """
    rng, tracker = task.rng, Tracker(task)
    genes = random_bits(rng, task.population, len(task.bounds), bits)
    values = tracker.evaluate(decode(genes, task.bounds))
    tracker.iteration_done()
    for _ in range(task.iterations):
        parents = genes[roulette(merits(values), rng)]
        genes = mutate(crossover(parents, rng, crossover_rate), rng, mutation_rate)
        values = tracker.evaluate(decode(genes, task.bounds))
        tracker.iteration_done()
    return tracker.result()
