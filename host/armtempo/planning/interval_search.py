"""The search for the intervals of a time axis, within bounds that are computed from the job and widened if needed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.progress import Progress
from armtempo.model.job import GRADIENT, Job
from armtempo.model.parts import Limits
from armtempo.optimise import Settings, minimise
from armtempo.optimise.task import Result
from armtempo.planning import checks, rest_to_rest
from armtempo.planning.fitness import Fitness
from armtempo.planning.fixed_path import FixedPath
from armtempo.splines import bspline

_REACH = 6.0
"""Factor of the bounds below and above the estimated interval."""
_WIDER = 6.0
_WIDENINGS = 3
_NEAR = 1.01
"""An interval within this factor of a bound counts as at the bound."""
_COARSE_GAP = 1e-3


@dataclass(frozen=True, eq=False)
class Found:
    """The result of the search, and notes for the user."""

    result: Result
    starts_s: Array
    """Motion time of each start of a gradient search; else empty."""
    notes: tuple[str, ...] = ()


def bounds_s(angle_points_deg: Array, degree: int, limits: Sequence[Limits]) -> Array:
    """Shortest and longest interval of the search for each path segment: (n, 2).

    The estimated time of each segment from rest to rest, divided and multiplied by _REACH.
    """
    pieces = bspline.polynomials(angle_points_deg, degree)
    via = np.concatenate([pieces[:, 0], pieces[-1:].sum(axis=1)])
    needed = rest_to_rest.needed_s(via, np.array([limit.values for limit in limits]))
    return np.stack([needed / _REACH, needed * _REACH], axis=1)


def search(
    angle_points_deg: Array, limits: Sequence[Limits], job: Job, rng: np.random.Generator, progress: Progress
) -> Found:
    """Intervals (n,) by the job's optimiser, for joints on one axis with control points (n + degree, J).

    If the result is at computed bounds, they are widened and the search is repeated; at the job's bounds
    there is only a note. Gradients start within the bounds and may leave them.
    """
    box = bounds_s(angle_points_deg, job.degree, limits)
    if job.bounds_s is not None:
        box = np.tile(np.array(job.bounds_s), (len(box), 1))
    if job.optimiser == GRADIENT:
        path = FixedPath(angle_points_deg, job.degree, limits, mirrored=True)
        return gradient(path, box, rng, job.starts, progress)
    notes: list[str] = []
    best: Found | None = None
    for widening in range(_WIDENINGS + 1):
        found = _once(angle_points_deg, limits, job, box, rng, progress)
        best = found if best is None or found.result.value < best.result.value else best
        held = _held(
            found.result.x, box, relative=job.parameters.get("fitness", checks.FITNESS[0]) == "stretched"
        )
        if not len(held):
            break
        named = ", ".join(str(number + 1) for number in held)
        if job.bounds_s is not None:
            notes.append(
                f"the search ended at bounds_s with interval {named}; without bounds_s in the job they follow from it"
            )
            break
        if widening < _WIDENINGS:
            notes.append(
                f"the search ended at the bounds of interval {named}; they were widened {_WIDER:g} times"
            )
            box = box * np.array([1.0 / _WIDER, _WIDER])
    assert best is not None
    return replace(best, notes=tuple(notes))


def _once(
    points: Array,
    limits: Sequence[Limits],
    job: Job,
    box: Array,
    rng: np.random.Generator,
    progress: Progress,
) -> Found:
    fitness = Fitness(points, job.degree, limits)
    parameters = dict(job.parameters)
    function = getattr(fitness, str(parameters.pop("fitness", checks.FITNESS[0])))
    settings = Settings(job.optimiser, job.population, job.iterations, parameters)
    return Found(minimise(function, box, rng, settings, progress), np.empty(0))


def gradient(
    path: FixedPath, box: Array, rng: np.random.Generator, starts: int, progress: Progress | None = None
) -> Found:
    """The best local optimum from ``starts`` random intervals within ``box`` (n, 2).

    ``evaluations`` is the number of starts; the history is the best motion time after each.
    """
    times: list[float] = []
    intervals = box[:, 0]
    low, high = np.log(box).T
    for number in range(starts):
        start = np.exp(rng.uniform(low, high))
        optimum = path.optimum(path.of_intervals(start), _COARSE_GAP)
        if optimum.total_s < min(times, default=np.inf):
            intervals = path.intervals(optimum.differences_s)
        times.append(optimum.total_s)
        if progress is not None:
            progress(number + 1, starts)
    history = np.minimum.accumulate(times)
    return Found(Result(intervals, float(history[-1]), starts, history), np.array(times))


def _held(x: Array, box: Array, relative: bool) -> np.ndarray:
    """Indices of the intervals x (n,) at the bounds.

    With ``relative`` only ratios count: if all of x can be scaled away from the bounds, none.
    """
    low, high = x / box[:, 0], box[:, 1] / x
    if not relative:
        return np.flatnonzero((low < _NEAR) | (high < _NEAR))
    if low.min() * high.min() > _NEAR**2:
        return np.empty(0, dtype=np.intp)
    return np.flatnonzero((low < low.min() * _NEAR) | (high < high.min() * _NEAR))
