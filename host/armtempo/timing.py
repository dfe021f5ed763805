"""From a path to its time axes: search, then exact stretch to the limits."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from armtempo import extremes, optimise, spline, timeaxis
from armtempo.arm import Limits
from armtempo.fitness import Fitness, stretch_of
from armtempo.job import Job
from armtempo.spline import Array

FITNESS = ("stretched", "penalised")
"""Values of the job's parameter ``fitness``: ``stretched`` scales each candidate until it just keeps its
limits,
``penalised`` is Eq. (21) as the paper has it."""

MIN_DURATION_S = 0.01
"""No motion is planned shorter: a tenth of the time between two samples."""

Progress = Callable[[float, float], None]
"""Called with the work done and the whole of it."""


@dataclass(frozen=True, eq=False)
class Timed:
    """A time axis: intervals (m,) that keep all limits, and the search that led to them."""

    intervals_s: Array
    found: optimise.Result
    searched_s: float


def axis(
    angle_points_deg: Array,
    limits: Sequence[Limits],
    job: Job,
    rng: np.random.Generator,
    progress: Progress | None = None,
) -> Timed:
    """The time axis of the joints whose control points are given, (n + degree, J), one of ``limits`` each."""
    parameters = dict(job.parameters)
    fitness = Fitness(angle_points_deg, job.degree, limits)
    function = getattr(fitness, str(parameters.pop("fitness", FITNESS[0])))
    found = optimise.minimise(
        function,
        [job.bounds_s] * fitness.intervals,
        rng,
        job.population,
        job.iterations,
        job.optimiser,
        progress,
        **parameters,
    )
    intervals = within_limits(angle_points_deg, found.x, limits, job.degree)
    searched = float(intervals.sum())
    if job.refine > 1:
        intervals = within_limits(
            angle_points_deg, np.repeat(intervals / job.refine, job.refine), limits, job.degree
        )
    return Timed(intervals, found, searched)


def within_limits(
    angle_points_deg: Array, intervals_s: Array, limits: Sequence[Limits], degree: int
) -> Array:
    """The intervals stretched or shrunk until the motion just keeps every limit: (m,), proven.

    Scaling time by s scales speed by 1/s, acceleration by 1/s², jerk by 1/s³.
    """
    segments = len(angle_points_deg) - degree
    pieces = spline.subdivide(spline.polynomials(angle_points_deg, degree), len(intervals_s) // segments)
    angle = np.ascontiguousarray(np.moveaxis(pieces, 2, 0))
    allowed = np.array([limit.values for limit in limits])
    for _ in range(2):  # the second round takes out the rounding of a large first factor
        time = spline.polynomials(timeaxis.control_points(intervals_s, degree), degree)
        factor = float(stretch_of((extremes.magnitudes(angle, time) / allowed).T).max())
        intervals_s = intervals_s * max(factor, MIN_DURATION_S / intervals_s.sum())
    return intervals_s
