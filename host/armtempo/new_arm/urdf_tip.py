"""The default tool link of a URDF."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from armtempo.basics.errors import InputError

_MOST = 8
"""Largest number of candidates in a message."""


class _Candidate(NamedTuple):
    """A possible tool link."""

    link: str
    turning: tuple[str, ...]
    """The revolute joints before it."""
    joints: int
    """Number of joints before it."""


def choose(path: Path, joints: Sequence[Any], first: str, reason: Callable[[Any], str]) -> str:
    """The parent link of the fingers, or the only leaf below ``first``.

    ``reason``: why an arm file cannot describe a joint, "" if it can. Raises InputError if the tool is
    ambiguous, with the candidates and the revolute joints before them, best first.
    """
    below = [*_below(joints, first)]
    fingers = _fingers(joints)
    flanges = {
        way[-1].parent
        for way in below
        if [joint.name for joint in way if joint.name in fingers] == [way[-1].name]
    }
    candidates = [*_candidates(below, reason)]
    if len(flanges) == 1 and flanges & {candidate.link for candidate in candidates}:
        return str(flanges.pop())
    parents = {joint.parent for joint in joints}
    ends = [way[-1].child for way in below if way[-1].child not in parents]
    if len(ends) == 1:
        return str(ends[0])
    candidates.sort(key=lambda candidate: (-len(candidate.turning), candidate.joints))
    words = [f"{candidate.link} ({', '.join(candidate.turning)})" for candidate in candidates[:_MOST]]
    more = f", and {len(candidates) - _MOST} more" if len(candidates) > _MOST else ""
    raise InputError(
        f"{path}: which link of the robot is the tool is not clear",
        f"choose with --tip, the joints that turn on the way in brackets: {', '.join(words) or 'none'}{more}",
    )


def _below(joints: Sequence[Any], first: str) -> Iterator[list[Any]]:
    """The way to each link below ``first``, in the order of the file."""
    above = {joint.child: joint for joint in joints}
    for joint in joints:
        way = [joint]
        while way[0].parent != first and way[0].parent in above and len(way) <= len(above):
            way.insert(0, above[way[0].parent])
        if way[0].parent == first:
            yield way


def _fingers(joints: Sequence[Any]) -> set[str]:
    """Names of the joints that slide, mimic another one, or are mimicked: of grippers."""
    mimicked = {joint.mimic.joint for joint in joints if joint.mimic is not None}
    slide_or_mimic = {joint.name for joint in joints if joint.type == "prismatic" or joint.mimic is not None}
    return mimicked | slide_or_mimic


def _candidates(ways: Sequence[list[Any]], reason: Callable[[Any], str]) -> Iterator[_Candidate]:
    """Links on whose way something turns, and nothing is there that an arm file cannot describe."""
    for way in ways:
        turning = tuple(joint.name for joint in way if joint.type != "fixed")
        if turning and not any(map(reason, way)):
            yield _Candidate(way[-1].child, turning, len(way))
