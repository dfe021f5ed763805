"""The standard genetic algorithm: J. H. Holland, "Adaptation in Natural and Artificial Systems",
University of Michigan Press 1975, in the form D. E. Goldberg gave it ("Genetic Algorithms in Search,
Optimization and Machine Learning", Addison-Wesley 1989, chapter 3): bit strings, roulette wheel (by rank),
one-point crossover, bit mutation, children replace their parents; nobody survives by privilege.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from armtempo.basics.arrays import Array
from armtempo.optimise.task import Number, Parameter, Result, Task, Tracker

Bits = NDArray[np.bool_]
"""A population: individuals × variables × bits, the first bit of a variable counting most."""

BITS = Number(16, 2, 52, "bits that code a variable")
"""Bits that code a variable; a double has 52 after its point."""
PARAMETERS: dict[str, Parameter] = {
    "bits": BITS,
    "crossover_rate": Number(0.6, 0.0, 1.0, "chance of a pair to be crossed"),
    "mutation_rate": Number(0.01, 0.0, 1.0, "chance of a bit to flip"),
}


def random_bits(rng: np.random.Generator, population: int, variables: int, bits: int) -> Bits:
    """A random population (population, variables, bits)."""
    return rng.random((population, variables, bits)) < 0.5


def decode(genes: Bits, bounds: Array) -> Array:
    """The points (N, d) of ``genes`` (N, d, bits), evenly spread over ``bounds`` (d, 2)."""
    weights = 0.5 ** np.arange(1, genes.shape[2] + 1)
    fraction = (genes @ weights) / weights.sum()
    low, high = bounds.T
    points: Array = low + np.minimum(fraction, 1.0) * (high - low)
    return np.clip(points, low, high)


def merits(values: Array) -> Array:
    """What selection maximises: 2 for the smallest of the values (N,), falling by rank to 0 for the largest.

    Linear ranking (J. E. Baker, "Adaptive selection methods for genetic algorithms", ICGA 1985, pp. 101-111),
    as a few individuals far outside the limits would otherwise make all the others look alike.
    """
    rank = np.empty(len(values))
    rank[np.argsort(values)] = np.arange(len(values))
    return np.asarray(2.0 - 2.0 * rank / max(len(values) - 1, 1))


def roulette(merit: Array, rng: np.random.Generator) -> NDArray[np.intp]:
    """Indices (N,) of parents, drawn with chances in proportion to ``merit`` (N,)."""
    return rng.choice(len(merit), size=len(merit), p=merit / merit.sum())


def crossover(parents: Bits, rng: np.random.Generator, probability: float | Array) -> Bits:
    """One-point crossover of parents 0 and 1, 2 and 3, …, each pair with its ``probability`` (N // 2,)."""
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
    """Flips each bit of an individual with that individual's ``probability``, a number or (N,)."""
    chance = np.asarray(probability, dtype=float).reshape(-1, 1, 1)
    flipped: Bits = genes ^ (rng.random(genes.shape) < chance)
    return flipped


def search(task: Task, *, bits: int, crossover_rate: float, mutation_rate: float) -> Result:
    """Minimises by N evaluations an iteration.

    ``bits`` code a variable, ``crossover_rate`` is the chance of a pair to be crossed,
    ``mutation_rate`` that of a bit to flip.
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
