"""From paths to time axes: search, polish, refine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from armtempo_shared import motion
from armtempo_shared.limits import MAX_MOTION_BYTES, MAX_SEGMENTS

from armtempo.basics.arrays import Array
from armtempo.basics.progress import Progress, stage
from armtempo.model.job import GRADIENT, REFINE, Job
from armtempo.model.parts import Limits
from armtempo.optimise import Settings, minimise
from armtempo.optimise.task import Result
from armtempo.planning import checks, rest_to_rest
from armtempo.planning.fitness import Fitness
from armtempo.planning.fixed_path import FixedPath, Optimum
from armtempo.planning.variables import time_points
from armtempo.splines import bspline, time_axis

MIN_DURATION_S = 0.01
"""Shortest motion: a tenth of the sampling interval."""

_POLISHED_GAP = 1e-8
_REFINED_GAP = 1e-4
"""Relative gap of an axis to its local optimum."""
_REFINE_FACTOR = 8
_PAYS = 1e-3
"""With ``refine = "auto"``: factor on the segments of an axis, and least relative saving of time."""


@dataclass(frozen=True, eq=False)
class Group:
    """Joints with a common time axis: control points (n + degree, J), and one of ``limits`` per joint."""

    joints: tuple[int, ...]
    """Indices among the driven joints."""
    angle_points_deg: Array
    limits: Sequence[Limits]


@dataclass(frozen=True, eq=False)
class Timed:
    """A time axis within all limits, (n * refine + degree,) control points, and its search."""

    time_points_s: Array
    intervals_s: Array
    """The variables: the intervals X (n,), or with refinement the differences of all control points."""
    refine: int
    total_s: float
    searched_s: float
    """Motion time by the search alone."""
    optimum_s: float
    """Lower bound of the local optimum with the same variables, if gradients were used; else 0."""
    found: Result
    starts_s: Array
    """Motion time of each start of a gradient search; else empty."""
    notes: tuple[str, ...]


def most_refine(job: Job, segments: int, joints: int) -> int:
    """The most time segments per path segment that the board's record can hold."""
    most = min(REFINE[1], MAX_SEGMENTS // segments)
    shared = job.timing == "shared"
    while most > 1 and motion.size(job.degree, joints, shared, segments, most) > MAX_MOTION_BYTES:
        most -= 1
    return most


def axes(groups: Sequence[Group], job: Job, most: int, progress: Progress | None = None) -> list[Timed]:
    """The time axis of each group, all with the same refinement; an automatic refinement is at most ``most``.

    The random numbers of a group depend only on the seed and its first joint.
    """
    levels = _levels(job, most)
    stages = _Stages(progress, len(groups), levels)
    timed = [_searched(group, job, stages, not levels) for group in groups]
    for before, refine in pairwise([1, *levels]):
        finer = []
        for group, axis in zip(groups, timed, strict=True):
            finer.append(_refined(group, job, axis, before, refine))
            stages.done()
        pays = any(new.total_s < old.total_s * (1 - _PAYS) for new, old in zip(finer, timed, strict=True))
        if job.refine != "auto" or _longest_s(finer) <= _longest_s(timed):
            timed = finer
        if not pays:
            break
    stages.end()
    return [_long_enough(axis) for axis in timed]


def _levels(job: Job, most: int) -> list[int]:
    """The refinements to try."""
    if isinstance(job.refine, int):
        return [job.refine] if job.refine > 1 else []
    levels, refine = [], 1
    while refine < most:
        refine = min(refine * _REFINE_FACTOR, most)
        levels.append(refine)
    return levels


def _longest_s(timed: Sequence[Timed]) -> float:
    """Motion time of all groups."""
    return max(axis.total_s for axis in timed)


def _searched(group: Group, job: Job, stages: _Stages, last: bool) -> Timed:
    """The axis of the search, polished if no finer one follows."""
    stage("searching")
    rng = np.random.default_rng([job.seed, group.joints[0]])
    found = search(group.angle_points_deg, group.limits, job, rng, stages.within)
    stages.done()
    path = FixedPath(group.angle_points_deg, job.degree, group.limits, mirrored=True)
    differences = path.scaled(path.of_intervals(found.result.x))
    searched = path.duration_s(differences)
    optimum = Optimum(differences, searched, 0.0)
    if job.polish and last:
        stage("polishing")
        optimum = path.optimum(differences, _POLISHED_GAP)
    stages.done()
    intervals = path.intervals(optimum.differences_s)
    return Timed(
        intervals @ time_axis.step_map(len(intervals), job.degree),
        intervals,
        1,
        optimum.total_s,
        searched,
        optimum.bound_s,
        found.result,
        found.starts_s,
        found.notes,
    )


def _refined(group: Group, job: Job, axis: Timed, before: int, refine: int) -> Timed:
    """The axis with more segments, optimised; never slower."""
    stage(f"refining to {refine}")
    differences = np.diff(axis.time_points_s)
    start = time_axis.cut(differences, before, refine, job.degree)
    path = FixedPath(group.angle_points_deg, job.degree, group.limits, refine)
    optimum = path.optimum(start, _REFINED_GAP)
    return replace(
        axis,
        time_points_s=time_points(optimum.differences_s, job.degree),
        intervals_s=optimum.differences_s,
        refine=refine,
        total_s=optimum.total_s,
        optimum_s=optimum.bound_s,
    )


def _long_enough(axis: Timed) -> Timed:
    scale = max(1.0, MIN_DURATION_S / axis.total_s)
    if scale == 1.0:
        return axis
    return replace(
        axis,
        time_points_s=axis.time_points_s * scale,
        intervals_s=axis.intervals_s * scale,
        total_s=axis.total_s * scale,
        optimum_s=MIN_DURATION_S if axis.optimum_s else 0.0,
    )


class _Stages:
    """Progress of search, polish and refinement of every group, weighted by their cost."""

    def __init__(self, progress: Progress | None, groups: int, levels: Sequence[int]) -> None:
        self._progress = progress
        self._weights = [1.0, 1.0] * groups
        for refine in levels:
            self._weights.extend([1.0 + refine / 4] * groups)
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

    def end(self) -> None:
        """All is done."""
        self._stage = len(self._weights)
        self.within(0.0, 1.0)


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
