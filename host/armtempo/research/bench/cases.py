"""Searches compared, as in Table 4 and Fig. 6: one problem, many algorithms, populations and seeds."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from concurrent.futures import Executor, as_completed
from dataclasses import dataclass

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.model.arm import Arm
from armtempo.model.job import GRADIENT, Job
from armtempo.model.parts import Limits
from armtempo.optimise import Function, Settings, minimise
from armtempo.planning import interval_search, planner
from armtempo.planning.fitness import Fitness
from armtempo.planning.fixed_path import FixedPath
from armtempo.splines import bspline


@dataclass(frozen=True)
class Problem:
    """What every search gets: the intervals of one joint's path, judged by ``planning.fitness``."""

    joint: str
    via_deg: tuple[float, ...]
    degree: int
    limits: Limits
    bounds_s: tuple[float, float]
    fitness: str
    """A method of ``Fitness``: ``"stretched"`` or ``"penalised"``."""
    iterations: int

    def points(self) -> Array:
        """Control points of the path: (n + degree, 1)."""
        return bspline.fit(np.array(self.via_deg)[:, None], self.degree)

    def function(self) -> Function:
        """Fitness (N,) of intervals (N, m)."""
        judge: Function = getattr(Fitness(self.points(), self.degree, [self.limits]), self.fitness)
        return judge


@dataclass(frozen=True, order=True)
class Case:
    """One run of the comparison."""

    algorithm: str
    population: int
    seed: int


@dataclass(frozen=True)
class Trial:
    """The outcome of a case."""

    case: Case
    intervals_s: tuple[float, ...]
    evaluations: int
    seconds: float
    """Of computing (the thread's own CPU time, so that other work on the machine does not count)."""
    improvements: tuple[tuple[int, float], ...]
    """The iterations (0: first population) that found better, and what."""

    @property
    def best_s(self) -> float:
        """The fitness reached."""
        return self.improvements[-1][1]

    def history(self, iterations: int) -> Array:
        """Best fitness after each iteration: (iterations + 1,)."""
        when = np.array([iteration for iteration, _ in self.improvements])
        values = np.array([value for _, value in self.improvements])
        return np.asarray(values[np.searchsorted(when, np.arange(iterations + 1), side="right") - 1])


def problem_of(arm: Arm, job: Job, joint: int, fitness: str, iterations: int) -> Problem:
    """The search for the intervals of driven joint ``joint``, counted from 1, of a job.

    Raises InputError where there is no such joint, or it does not move in this job.
    """
    if not 1 <= joint <= len(arm.driven):
        raise InputError(
            f"joint {joint}: arm {arm.name!r} has no such driven joint",
            f"give one of 1 to {len(arm.driven)}",
        )
    driven = arm.driven[joint - 1]
    angles_deg, _ = planner.via_angles(arm, job)
    via = angles_deg[:, joint - 1]
    if np.ptp(via) == 0.0:
        raise InputError(
            f"job {job.name!r}: {driven.name} does not move, so there is nothing to search",
            "choose another joint",
        )
    angles = tuple(float(angle) for angle in via)
    bounds = job.bounds_s
    if bounds is None:
        box = interval_search.bounds_s(bspline.fit(via[:, None], job.degree), job.degree, [driven.limits])
        bounds = (float(box.min()), float(box.max()))
    return Problem(driven.name, angles, job.degree, driven.limits, bounds, fitness, iterations)


def cases(algorithms: Iterable[str], populations: Iterable[int], seeds: Iterable[int]) -> list[Case]:
    """Every combination once, those that take longest first, so that all workers end together."""
    seeds, algorithms = list(seeds), list(algorithms)
    chosen = {Case(a, p, s) for p in populations for s in seeds for a in algorithms}
    return sorted(chosen, key=lambda case: (-case.population, case.seed, case.algorithm))


def solve(problem: Problem, case: Case) -> Trial:
    """Run one case. The same case gives the same trial on every worker, except for its seconds."""
    bounds = np.array([problem.bounds_s] * (len(problem.via_deg) - 1))
    rng = np.random.default_rng(case.seed)
    if case.algorithm == GRADIENT:
        path = FixedPath(problem.points(), problem.degree, [problem.limits], mirrored=True)
        start = time.thread_time()
        found = interval_search.gradient(path, bounds, rng, case.population).result
    else:
        function = problem.function()
        settings = Settings(case.algorithm, case.population, problem.iterations)
        start = time.thread_time()
        found = minimise(function, bounds, rng, settings)
    seconds = time.thread_time() - start
    better = [0, *(np.flatnonzero(np.diff(found.history) < 0) + 1)]
    improvements = tuple((int(at), float(found.history[at])) for at in better)
    return Trial(case, tuple(float(x) for x in found.x), found.evaluations, seconds, improvements)


def execute(problem: Problem, todo: Iterable[Case], executor: Executor) -> Iterator[Trial]:
    """Runs the cases on the executor's workers, and yields each run as it comes."""
    futures = [executor.submit(solve, problem, case) for case in todo]
    for future in as_completed(futures):
        yield future.result()
