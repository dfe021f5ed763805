"""Flash of the board that records take."""

from __future__ import annotations

from armtempo_shared import motion, sequence

from armtempo.model.sequence_plan import SequencePlan, rows_of
from armtempo.splines.trajectory import Trajectory

BLOCK = 512
"""Of the flash; a file takes whole ones."""
_SUFFIX = ".atm"
_ENTRY_BYTES, _LETTERS = 32, 13
"""A file has an entry in its folder, and one for each so many letters of its name."""


def in_blocks(size: int) -> int:
    """Bytes of the whole blocks that a file of ``size`` bytes takes."""
    return -(-size // BLOCK) * BLOCK


def of_names(names: list[str]) -> int:
    """Bytes that the folder grows by with records of these names."""
    entries = sum(1 - (-len(name + _SUFFIX) // _LETTERS) for name in names)
    return in_blocks(_ENTRY_BYTES * entries)


def of_plan(plan: SequencePlan) -> int:
    """Bytes that a sequence and its motions take."""
    keys = [(leg.name, 0) for leg in plan.legs]
    sizes = [_size(leg) for leg in plan.legs] + [len(sequence.pack(0, rows_of(plan), keys, plan.counters))]
    return sum(map(in_blocks, sizes)) + of_names([plan.name, *(name for name, _ in keys)])


def _size(leg: Trajectory) -> int:
    """Bytes of a motion's record."""
    first = leg.joints[0]
    segments = len(first.angle_points_deg) - first.degree
    return motion.size(first.degree, len(leg.joints), leg.shared, segments, first.refine)
