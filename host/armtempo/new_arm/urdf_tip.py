"""Which link of a URDF is the tool: the parent of the fingers, or the only end."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from armtempo.basics.errors import InputError
from armtempo.new_arm.urdf_refusals import SLIDING, reasons

_MOST = 8
"""Largest number of candidates in a message."""


class _Candidate(NamedTuple):
    """A possible tool link."""

    link: str
    turning: tuple[str, ...]
    """The revolute joints before it."""
    joints: int
    """Number of joints before it."""


def find(path: Path, joints: Sequence[Any], first: str) -> str:
    """The parent link of the fingers, or the only leaf below ``first``.

    Raises InputError if the tool is ambiguous, with the candidates and the revolute joints before them, best first.
    """
    below = [*_below(joints, first)]
    fingers = _fingers(joints)
    flanges = {
        chain[-1].parent
        for chain in below
        if [joint.name for joint in chain if joint.name in fingers] == [chain[-1].name]
    }
    candidates = [*_candidates(below)]
    if len(flanges) == 1 and flanges & {candidate.link for candidate in candidates}:
        return str(flanges.pop())
    parents = {joint.parent for joint in joints}
    ends = [chain[-1].child for chain in below if chain[-1].child not in parents]
    if len(ends) == 1:
        return str(ends[0])
    candidates.sort(key=lambda candidate: (-len(candidate.turning), candidate.joints))
    words = [f"{candidate.link} ({', '.join(candidate.turning)})" for candidate in candidates[:_MOST]]
    more = f", and {len(candidates) - _MOST} more" if len(candidates) > _MOST else ""
    raise InputError(
        f"{path}: which link of the robot is the tool is not clear",
        f"choose with --tip, the joints that turn on its chain in brackets: {', '.join(words) or 'none'}{more}",
    )


def _below(joints: Sequence[Any], first: str) -> Iterator[list[Any]]:
    """The chain to each link below ``first``, in the order of the file."""
    above = {joint.child: joint for joint in joints}
    for joint in joints:
        chain = [joint]
        while chain[0].parent != first and chain[0].parent in above and len(chain) <= len(above):
            chain.insert(0, above[chain[0].parent])
        if chain[0].parent == first:
            yield chain


def _fingers(joints: Sequence[Any]) -> set[str]:
    """Names of the joints of grippers: side by side, they slide, or one mimics the other.

    A joint that mimics one of its own chain, as a linkage does, and one that slides alone are parts of the arm.
    """
    above = {joint.child: joint for joint in joints}
    before_of = {joint.name: {each.name for each in _before(joint, above)} for joint in joints}
    slides = [joint.name for joint in joints if joint.type == SLIDING]
    found = set()
    for joint in joints:
        before = before_of[joint.name]
        master = None if joint.mimic is None else joint.mimic.joint
        if master is not None and master not in before and joint.name not in before_of[master]:
            found |= {joint.name, master}
        if joint.name in slides:
            after = {name for name, above_it in before_of.items() if joint.name in above_it}
            if set(slides) - before - after - {joint.name}:
                found.add(joint.name)
    return found


def _before(joint: Any, above: Mapping[str, Any]) -> list[Any]:
    """The joints from the root to this one, without it."""
    found: list[Any] = []
    while joint.parent in above and len(found) <= len(above):
        joint = above[joint.parent]
        found.append(joint)
    return found


def _candidates(chains: Sequence[list[Any]]) -> Iterator[_Candidate]:
    """Links on whose chain something turns, and nothing is there that an arm file cannot describe."""
    for chain in chains:
        turning = tuple(joint.name for joint in chain if joint.type != "fixed")
        if turning and not any(reason for _, reason in reasons(chain)):
            yield _Candidate(chain[-1].child, turning, len(chain))
