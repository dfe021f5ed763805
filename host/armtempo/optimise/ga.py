"""The standard genetic algorithm: J. H. Holland, "Adaptation in Natural and Artificial Systems",
University of Michigan Press 1975, in the form D. E. Goldberg gave it ("Genetic Algorithms in Search,
Optimization and Machine Learning", Addison-Wesley 1989, chapter 3): bit strings, roulette wheel (by rank),
one-point crossover, bit mutation, children replace their parents; nobody survives by privilege.
"""

from __future__ import annotations

from armtempo.optimise.genes import BITS, crossover, decode, merits, mutate, random_bits, roulette
from armtempo.optimise.parameters import Number, Parameter
from armtempo.optimise.tracker import Result, Task, Tracker

PARAMETERS: dict[str, Parameter] = {
    "bits": BITS,
    "crossover_rate": Number(0.6, 0.0, 1.0, "chance of a pair to be crossed"),
    "mutation_rate": Number(0.01, 0.0, 1.0, "chance of a bit to flip"),
}


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
