"""Flash of the board that records take."""

from __future__ import annotations

from armtempo_shared import motion, sequence

from armtempo.encoding import made_with
from armtempo.model.plan import Plan
from armtempo.splines.trajectory import Trajectory

BLOCK = 512
"""Of the flash; a file takes whole ones."""
EMPTY_BYTES = 180 * BLOCK
"""Free on a new STM32F4DISC: MicroPython's files take 10 of 190 blocks (host/docs/virtual-board.md)."""
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


def of_plan(plan: Plan) -> int:
    """Bytes that a sequence and its motions take."""
    legs = [leg.trajectory for leg in plan.legs]
    keys, rows = [(leg.name, 0) for leg in legs], [row.numbers for row in plan.rows]
    record = made_with.added(sequence.pack(0, rows, keys, plan.counters), made_with.of_plan(plan))
    sizes = [*map(of_trajectory, legs), len(record)]
    return sum(map(in_blocks, sizes)) + of_names([plan.name, *(name for name, _ in keys)])


def words(plan: Plan) -> str:
    """Bytes that a sequence and its motions take, and whether they are more than a new board has."""
    needed = of_plan(plan)
    more = f", more than the {EMPTY_BYTES} of a new board: an upload is refused; plan a part of the pallet"
    return f"{needed} bytes of flash" + more * (needed > EMPTY_BYTES)


def of_trajectory(trajectory: Trajectory) -> int:
    """Bytes of a motion's record, without what it was made with."""
    first = trajectory.joints[0]
    segments = len(first.angle_points_deg) - first.degree
    return motion.size(first.degree, len(trajectory.joints), trajectory.shared, segments, first.refine)
