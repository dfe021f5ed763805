"""What the paper leaves open in its adaptive cuckoo search, choice by choice, on its own three joints.

    python -m tests.benchmark.acs_choices [--seeds 100] [--population 10] [--iterations 500]

Prints, for each joint, how far in percent the planned motion time lies above the best known: median and
worst over the seeds. Motion times are those of finished plans, which keep every limit exactly.
"""

from __future__ import annotations

import argparse
import math
import time

import numpy as np
from armtempo import optimise
from armtempo.optimise import acs
from armtempo.optimise.tracker import Array
from armtempo.planning.constraints import Path
from armtempo.planning.fitness import Fitness
from armtempo.splines import bspline, time_axis

from tests.host import problems

FEEDING = problems.load()[0]


class PerVariable(acs.Differences):
    """One Lévy number for each variable."""

    def iterate(self, part: float) -> None:
        self.settle(self.x + self.a * self.levy(self.x.shape) * self.difference())
        self.move(part)

    def move(self, part: float) -> None:
        """The second half of an iteration, as in the default."""
        abandoned = self.rng.random(self.x.shape) < self.pa
        if part < 1:
            self.settle(self.x + abandoned * self.rng.random((self.size, 1)) * self.difference())
        self.tracker.iteration_done()


class FromBest(PerVariable):
    """Flights scaled by the way from the best nest, as in the code of the first cuckoo search."""

    def iterate(self, part: float) -> None:
        self.settle(self.x + self.a * self.levy((self.size, 1)) * (self.x - self.tracker.x))
        self.move(part)


class Decaying(PerVariable):
    """Differences, times alpha_A of Eq. (25) with F_m over its first value."""

    first = 0.0

    def iterate(self, part: float) -> None:
        mean = float(self.values.mean())
        self.first = self.first or mean
        alpha = self.a * self.size**self.b * math.exp(-part * mean / self.first)
        self.settle(self.x + alpha * self.levy((self.size, 1)) * self.difference())
        self.move(part)


class WorstAbandoned(acs.Differences):
    """The worst ``pa`` of the nests fly again, from a better nest."""

    def iterate(self, part: float) -> None:
        self.settle(self.x + self.a * self.levy((self.size, 1)) * self.difference())
        order = np.argsort(self.values)
        count = math.floor(self.pa * self.size)
        source = self.rng.choice(order[: self.size - count], count)
        flights = self.a * self.levy((count, 1)) * self.difference()[:count]
        self.settle(self.x[source] + flights, order[self.size - count :])
        self.tracker.iteration_done()


FORMS: dict[str, tuple[type[acs.Nests], str, dict[str, float]]] = {
    "differences (default)": (acs.Differences, "stretched", {}),
    "differences, fitness of Eq. (21)": (acs.Differences, "penalised", {}),
    "paper": (acs.Paper, "stretched", {}),
    "paper, fitness of Eq. (21)": (acs.Paper, "penalised", {}),
    "one Lévy number a variable": (PerVariable, "stretched", {}),
    "scaled by the way from the best nest": (FromBest, "stretched", {}),
    "alpha_A of Eq. (25) with F_m over its first value": (Decaying, "stretched", {}),
    "worst nests abandoned": (WorstAbandoned, "stretched", {}),
    "a = 0.4": (acs.Differences, "stretched", {"a": 0.4}),
    "a = 1": (acs.Differences, "stretched", {"a": 1.0}),
    "pa = 0.1": (acs.Differences, "stretched", {"pa": 0.1}),
    "pa = 0.5": (acs.Differences, "stretched", {"pa": 0.5}),
}


def totals(form: str, joint: int, seeds: int, population: int, iterations: int) -> Array:
    """Planned motion times over the seeds, in percent above the best known: (seeds,)."""
    kind, fitness, parameters = FORMS[form]
    acs.VARIANTS["differences"] = kind
    points = bspline.fit(np.array(FEEDING.job.via), 5)[:, [joint]]
    limits = FEEDING.arm.driven[joint].limits
    function = getattr(Fitness(points, 5, [limits]), fitness)
    path = Path(points, 5, [limits], time_axis.step_map(len(points) - 5, 5))
    found = []
    for seed in range(seeds):
        best = optimise.minimise(
            function,
            [(0.1, 3.0)] * len(path.weights),
            np.random.default_rng([seed, joint]),
            optimise.Settings("acs", population, iterations, parameters),
        )
        assert best.evaluations <= 2 * population * iterations
        found.append(path.duration_s(path.stretched(best.x)))
    return 100 * (np.array(found) / FEEDING.best_s[joint] - 1)


def main() -> None:
    """The table, in Markdown."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--population", type=int, default=10)
    parser.add_argument("--iterations", type=int, default=500)
    options = parser.parse_args()
    print("| form | joint 1 | joint 2 | joint 3 | CPU s a run |\n|---|---|---|---|---|")
    for form in FORMS:
        start = time.process_time()
        cells = []
        for joint in range(3):
            over = totals(form, joint, options.seeds, options.population, options.iterations)
            cells.append(f"{np.median(over):.4f} / {over.max():.4f}")
        spent = (time.process_time() - start) / (3 * options.seeds)
        print(f"| {form} | {' | '.join(cells)} | {spent:.3f} |", flush=True)


if __name__ == "__main__":
    main()
