"""Via points less than a step apart are one point, as a spline on even knots swings out beside two of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.model import point_groups, tool_segment
from armtempo.model.arm import Arm
from armtempo.model.job import Job, Stop
from armtempo.model.tool_segment import ToolSegment
from armtempo.planning import checks

_KEYS = ("blend_mm", "speed_mm_s", "acceleration_mm_s2")


class Merged(NamedTuple):
    """A job without via points less than a step apart."""

    job: Job
    kept: list[int]
    """Of its via points, their numbers in the other job."""
    notes: tuple[str, ...]
    """One for each point that was several."""


def merged(arm: Arm, job: Job, via_deg: Array) -> Merged:
    """The job with via points as one that are less than a step of each motor apart.

    ``via_deg``: (n + 1, J), the angles at the via points. The first point of a group stays, or the motion's last; the
    two ends are never one. Stops stay, and their dwells add up; what is asked of the tool between points that become
    one counts for the way to them. Raises InputError if that is not the same, or a dwell would be at an end.
    """
    groups = point_groups.groups(arm.transmission.steps(via_deg), partial(_may_join, job))
    if len(groups) == len(job.via):
        return Merged(job, list(range(len(job.via))), ())
    last = len(job.via) - 1
    kept = [point_groups.kept(group, last) for group in groups]
    segments = []
    stops = []
    notes = []
    for number, group in enumerate(groups):
        if (segment := _segment(job, group)) is not None:
            segments.append(replace(segment, via=number))
        inside = [stop for stop in job.stops if stop.via in group]
        rest_s = sum(stop.dwell_s for stop in inside)
        if group[0] == 0 or group[-1] == last:
            if rest_s:
                raise _conflict(
                    job, group, f"the dwell_s of P{inside[0].via}", "is not at an end of the motion"
                )
        elif inside:
            stops.append(Stop(number, rest_s))
        if len(group) > 1:
            rests = f", with {rest_s:g} s of rest" if rest_s else ""
            place = via_deg[kept[number]].tolist()
            where = arm.texts.listed(f"{round(angle, 4) + 0.0:g}" for angle in place)
            notes.append(
                f"{_named(group)} are less than a step apart, and planned as one point, P{number} at {where}{rests}; "
                "later via points count from it"
            )
    via = tuple(job.via[number] for number in kept)
    found = replace(job, via=via, stops=tuple(stops), tool_segments=tuple(segments))
    return Merged(found, kept, tuple(notes))


def _may_join(job: Job, before: int, number: int) -> bool:
    """Whether nothing leads away and back between two via points, and a free path need not find its own places."""
    segment = tool_segment.at(job.tool_segments, number)
    if segment is not None and (segment.arc_through_mm or segment.circle_through_mm):
        return False
    return not (checks.is_free(job) and any(checks.is_wide(job.via[each]) for each in (before, number)))


def _segment(job: Job, group: Sequence[int]) -> ToolSegment | None:
    """What is asked of the tool on the way to a group of via points."""
    way = tool_segment.at(job.tool_segments, group[0])
    for number in group[1:]:
        inside = tool_segment.at(job.tool_segments, number)
        for key in _KEYS if inside is not None else ():
            value = getattr(inside, key)
            if value != getattr(way, key, None) and (
                value or (key == "blend_mm" and getattr(way, key, None))
            ):
                raise _conflict(job, group, f"{key} of P{number}", f"is not that of the way to P{group[0]}")
    return way


def _conflict(job: Job, group: Sequence[int], what: str, why: str) -> InputError:
    return InputError(
        f"job {job.name!r}: {_named(group)} are less than a step apart, so they are one point, but {what} {why}",
        "leave that out, or all but one of these via points",
    )


def _named(group: Sequence[int]) -> str:
    names = [f"P{number}" for number in group]
    return f"{', '.join(names[:-1])} and {names[-1]}"
