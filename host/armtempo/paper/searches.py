"""Table 4 and Fig. 6: six algorithms, four populations, the paper's fitness, Eq. (21)."""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from armtempo import optimise
from armtempo.basics.arrays import Array
from armtempo.basics.progress import Progress
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.parts import Limits
from armtempo.paper.printed import BETTER, DIFFERS, SAME, SEARCHES_S, Claim
from armtempo.planning import planner
from armtempo.planning.fitness import Fitness
from armtempo.report.plots import COLOURS, new_figure, theme
from armtempo.splines import bspline

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ITERATIONS = 500
POPULATIONS = (10, 50, 100, 500)
QUICK_POPULATIONS = (10, 50)
SEEDS, QUICK_SEEDS = 10, 3
QUANTILES = (0.0, 0.25, 0.5, 0.75, 1.0)
_SAME_S = 0.02
"""Difference up to which the best values of single runs of a random search count as equal."""
_BECAUSE = {
    SAME: "",
    BETTER: "the paper does not give its parameters; ours are in docs/optimisers.md",
    DIFFERS: "printed: one run of a random search; ours: the median over seeds",
}
_HEADROOM = 1.5
"""Top of Fig. 6's time axis, as a multiple of the best time."""

Case = tuple[str, int, int]
"""Algorithm, population, seed."""


@dataclass(frozen=True)
class Row:
    """The results of one algorithm and population over all seeds."""

    algorithm: str
    population: int
    seeds: int
    curves: Array
    """QUANTILES over the seeds of the best fitness so far, seconds: (5, iterations + 1)."""

    @property
    def best_s(self) -> float:
        """The best of all seeds after the last iteration."""
        return float(self.curves[0, -1])

    @property
    def median_s(self) -> float:
        """The median over the seeds after the last iteration."""
        return float(self.curves[2, -1])

    @property
    def worst_s(self) -> float:
        """The worst of all seeds after the last iteration."""
        return float(self.curves[-1, -1])


@dataclass(frozen=True)
class _Search:
    """The search for the intervals of joint 1 with the fitness of Eq. (21); called in other processes."""

    points: Array
    job: Job
    limits: Limits

    @classmethod
    def of(cls, arm: Arm, job: Job) -> _Search:
        angles_deg, _ = planner.via_angles(arm, job)
        return cls(bspline.fit(angles_deg[:, :1], job.degree), job, arm.driven[0].limits)

    def problem(self) -> tuple[Fitness, Array]:
        """Fitness, and bounds (n, 2) of the intervals."""
        fitness = Fitness(self.points, self.job.degree, [self.limits])
        return fitness, np.array([self.job.bounds_s] * fitness.intervals)

    def __call__(self, case: Case) -> tuple[Case, Array]:
        algorithm, population, seed = case
        fitness, bounds = self.problem()
        settings = optimise.Settings(algorithm, population, ITERATIONS)
        found = optimise.minimise(fitness.penalised, bounds, np.random.default_rng(seed), settings)
        return case, found.history


def run(arm: Arm, job: Job, quick: bool, progress: Progress) -> list[Row]:
    """Run all searches for the intervals of joint 1 of the shipped job, on all cores; Ctrl-C ends them at once."""
    seeds = range(1, (QUICK_SEEDS if quick else SEEDS) + 1)
    cases = list(product(SEARCHES_S, QUICK_POPULATIONS if quick else POPULATIONS, seeds))
    cases.sort(key=lambda case: -case[1])  # longest first, so that all processes end at about the same time
    found = []
    with multiprocessing.get_context("spawn").Pool(initializer=_ignore_interrupt) as pool:
        for number, done in enumerate(pool.imap_unordered(_Search.of(arm, job), cases), 1):
            found.append(done)
            progress(number, len(cases))
    return rows(found)


def _ignore_interrupt() -> None:
    """Ignore Ctrl-C, which reaches every process of the terminal; the main one ends the others."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def rows(found: Iterable[tuple[Case, Array]]) -> list[Row]:
    """The rows in the order of Table 4, from histories (iterations + 1,)."""
    groups: dict[tuple[str, int], list[Array]] = {}
    for (algorithm, population, _), history in found:
        groups.setdefault((algorithm, population), []).append(history)
    order = list(SEARCHES_S)
    return [
        Row(*key, len(groups[key]), np.quantile(groups[key], QUANTILES, axis=0))
        for key in sorted(groups, key=lambda key: (order.index(key[0]), key[1]))
    ]


def claims(found: Sequence[Row]) -> list[Claim]:
    """The printed values compared with our median and range over the seeds."""
    return [_claim(row) for row in found]


def _claim(row: Row) -> Claim:
    printed = SEARCHES_S[row.algorithm][row.population]
    verdict = SAME
    if abs(row.median_s - printed) > _SAME_S:
        verdict = BETTER if row.median_s < printed else DIFFERS
    because = _BECAUSE[verdict]
    text = f"{row.median_s:.3f} ({row.best_s:.3f} to {row.worst_s:.3f})"
    what = f"{row.algorithm.upper()}, population {row.population}, fitness of joint 1 (s)"
    return Claim("Table 4", what, f"{printed:.3f}", text, verdict, because)


def figure(found: Sequence[Row]) -> Figure:
    """Fig. 6, with axes for each population: median over the seeds, quartiles and range as bands."""
    populations = sorted({row.population for row in found})
    columns = min(2, len(populations))
    lines = -(-len(populations) // columns)
    drawn, axes = new_figure(lines, columns, 4.5 * columns + 0.5, 3.2 * lines + 0.5)
    floor = min(row.best_s for row in found)
    order = list(SEARCHES_S)
    for population, axis in zip(populations, axes.flat, strict=False):
        for row in (row for row in found if row.population == population):
            colour = COLOURS[order.index(row.algorithm)]
            iterations = np.arange(row.curves.shape[1])
            best, low, median, high, worst = row.curves
            axis.fill_between(iterations, best, worst, color=colour, alpha=0.1, linewidth=0)
            axis.fill_between(iterations, low, high, color=colour, alpha=0.25, linewidth=0)
            axis.plot(iterations, median, color=colour, label=row.algorithm.upper())
        axis.set_title(f"population {population}")
        axis.set_xlabel("iteration")
        axis.set_ylabel("fitness (s)")
        axis.set_ylim(0.99 * floor, _HEADROOM * floor)
    for axis in axes.flat[len(populations) :]:
        axis.set_visible(False)
    axes.flat[0].legend(frameon=False)
    for axis in axes.flat:
        theme(axis)
    return drawn
