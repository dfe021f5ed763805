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
from armtempo.model.job import REFINE, Job
from armtempo.model.parts import Limits
from armtempo.optimise.task import Result
from armtempo.planning import interval_search
from armtempo.planning.fixed_path import FixedPath, Optimum
from armtempo.planning.variables import time_points
from armtempo.splines import time_axis

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
    found = interval_search.search(group.angle_points_deg, group.limits, job, rng, stages.within)
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
