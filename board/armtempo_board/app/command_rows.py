"""Formats of the commands, from the message table; imported for commands that are refused during a motion.

Unloaded before a motion, as the rows need heap.
"""

from armtempo_board import heap

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any


def by_number() -> "dict[int, Any]":
    """For each command: its name, the formats of its fields and of its answer's fields, and its tail."""
    from armtempo_shared.table import rows  # here, so that it can be forgotten at once

    kept: "dict[str, str]" = {}  # equal strings are shared to save heap
    found = {}
    for (name, number, fields, _, tail), (_, _, values, _, _) in zip(rows("C"), rows("A")):
        found[number] = name, kept.setdefault(fields, fields), kept.setdefault(values, values), tail
    return found


ROWS = by_number()
heap.forget("table")
