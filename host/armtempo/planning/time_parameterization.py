"""From a path to its time axis: search, stretch to the limits, polish, refine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate
from operator import mul

import numpy as np

from armtempo import optimise
from armtempo.arrays import Array
from armtempo.model.arm import Limits
from armtempo.model.job import Job
from armtempo.planning import checks, local_search
from armtempo.planning.constraints import Path
from armtempo.planning.fitness import Fitness
from armtempo.progress import Progress
from armtempo.splines import time_axis

MIN_DURATION_S = 0.01
"""No motion is planned shorter: a tenth of the time between two samples."""

_REFINED_GAP = 5e-5
"""How near to its local optimum a refined axis must come; more would take most of the time for nothing."""


@dataclass(frozen=True, eq=False)
class Timed:
    """A time axis, (m + degree,) control points, that keeps all limits, and how it was found."""

    time_points_s: Array
    intervals_s: Array
    """What was varied: the intervals X (n,), or with refinement the differences of all control points."""
    total_s: float
    searched_s: float
    """Motion time by the search alone."""
    optimum_s: float
    """Bound on the local optimum from below, where polished; else 0."""
    found: optimise.Result


def axis(
    angle_points_deg: Array,
    limits: Sequence[Limits],
    job: Job,
    rng: np.random.Generator,
    progress: Progress | None = None,
) -> Timed:
    """The time axis of the joints whose control points are given, (n + degree, J), one of ``limits`` each."""
    stages = _Stages(progress, job)
    found = _search(Fitness(angle_points_deg, job.degree, limits), job, rng, stages.within)
    stages.done()
    count = len(angle_points_deg) - job.degree
    path = Path(angle_points_deg, job.degree, limits, time_axis.step_map(count, job.degree))
    y = path.stretched(found.x)
    searched, optimum = path.duration_s(y), 0.0
    if job.polish or job.refine > 1:
        polished = local_search.polish(path, y)
        y, optimum = polished.y, polished.bound_s
        stages.done()
    if job.refine > 1:
        path, polished = _refined(angle_points_deg, limits, job, y, stages)
        y, optimum = polished.y, polished.bound_s
    y = y * max(1.0, MIN_DURATION_S / path.duration_s(y))
    bound = max(optimum, MIN_DURATION_S) if optimum else 0.0
    return Timed(y @ path.axis, y, path.duration_s(y), searched, bound, found)


def _search(fitness: Fitness, job: Job, rng: np.random.Generator, progress: Progress) -> optimise.Result:
    parameters = dict(job.parameters)
    function = getattr(fitness, str(parameters.pop("fitness", checks.FITNESS[0])))
    return optimise.minimise(
        function,
        [job.bounds_s] * fitness.intervals,
        rng,
        optimise.Settings(job.optimiser, job.population, job.iterations, parameters),
        progress,
    )


def _refined(
    angle_points_deg: Array, limits: Sequence[Limits], job: Job, intervals_s: Array, stages: _Stages
) -> tuple[Path, local_search.Polished]:
    """The best axis of job.refine times as many segments, through ever finer ones.

    Each starts from the same time law as the one before it, cut finer, so that none is slower.
    """
    edge, count = (job.degree - 1) // 2, len(intervals_s)
    y = intervals_s[time_axis.mirrored(count, edge)]
    for factor in _factors(job.refine):
        y, count = time_axis.refined(y, factor, job.degree), count * factor
        path = Path(angle_points_deg, job.degree, limits, time_axis.free_map(count, job.degree))
        y = local_search.improve(path, y).y
        stages.done()
    found = local_search.polish(path, y, _REFINED_GAP)
    stages.done()
    return path, found


class _Stages:
    """Progress through search, polish and refinement, each weighted by what it takes."""

    def __init__(self, progress: Progress | None, job: Job) -> None:
        self._progress = progress
        self._weights = [1.0]
        if job.polish or job.refine > 1:
            self._weights.append(1.0)
        parts = list(accumulate(_factors(job.refine), mul))
        self._weights.extend(part**1.5 for part in [*parts, *parts[-1:]])
        self._stage = 0

    def within(self, done: float, whole: float) -> None:
        """A part of the stage is done."""
        if self._progress is not None:
            before = sum(self._weights[: self._stage])
            share = self._weights[self._stage] if self._stage < len(self._weights) else 0.0
            self._progress(before + share * done / whole, sum(self._weights))

    def done(self) -> None:
        """The stage is done, the next one begins."""
        self._stage += 1
        self.within(0.0, 1.0)


def _factors(number: int) -> list[int]:
    """Prime factors, smallest first."""
    factors, divisor = [], 2
    while number > 1:
        while number % divisor == 0:
            factors.append(divisor)
            number //= divisor
        divisor += 1
    return factors
