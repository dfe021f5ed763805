"""A job cut at its stops into jobs that fit the board."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

from armtempo_shared.limits import LONGEST_TICKS, MAX_NAME, TICK_HZ

from armtempo.basics.arrays import Array
from armtempo.basics.errors import PlanError
from armtempo.model.job import Job, Stop
from armtempo.splines.trajectory import Trajectory

LONGEST_S = LONGEST_TICKS / TICK_HZ
"""Longest motion of the board."""
_MARGIN = 0.98
"""Used fraction of it: a part planned separately may take a little longer."""


def at_all_stops(job: Job, via_deg: Array) -> list[Job]:
    """A job for each leg between stops; ``via_deg``: (n + 1, J), the angles at the via points.

    Raises PlanError if there is no stop.
    """
    return _parts(job, via_deg, [stop.via for stop in _stops(job)])


def at_few_stops(job: Job, via_deg: Array, whole: Trajectory) -> list[Job]:
    """The fewest jobs that fit the board, from the times at which ``whole`` passes the stops.

    Raises PlanError if there is no stop, or one leg is too long.
    """
    times = whole.joints[0].via_times_s
    cuts: list[int] = []
    begin = 0
    marks = [*(stop.via for stop in _stops(job)), len(via_deg) - 1]
    for here, after in pairwise([0, *marks]):
        if times[after] - times[begin] > _MARGIN * LONGEST_S and here > begin:
            cuts.append(here)
            begin = here
        takes_s = times[after] - times[begin]
        if takes_s > LONGEST_S:
            raise PlanError(
                f"job {job.name!r}: from via point {begin + 1} to {after + 1} it takes {takes_s:.0f} s, the "
                f"board counts to {LONGEST_S:.0f} s",
                "mark a via point between them with stop = true",
            )
    return _parts(job, via_deg, cuts)


def _stops(job: Job) -> Sequence[Stop]:
    if not job.stops:
        raise PlanError(
            f"job {job.name!r}: there is no rest to split it at",
            "mark via points with stop = true in the job file",
        )
    return job.stops


def _parts(job: Job, via_deg: Array, cuts: Sequence[int]) -> list[Job]:
    """The jobs between these via points, from angles to angles."""
    parts = []
    for number, (first, last) in enumerate(pairwise([0, *cuts, len(via_deg) - 1]), 1):
        ends = [tuple(via_deg[via].tolist()) for via in (first, last)]
        suffix = f"-{number}"
        parts.append(
            replace(
                job,
                name=job.name[: MAX_NAME - len(suffix)] + suffix,
                via=(ends[0], *job.via[first + 1 : last], ends[1]),
                stops=tuple(
                    replace(stop, via=stop.via - first) for stop in job.stops if first < stop.via < last
                ),
                tool_segments=tuple(
                    replace(each, via=each.via - first)
                    for each in job.tool_segments
                    if first < each.via <= last
                ),
            )
        )
    return parts
