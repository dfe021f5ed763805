"""How each command is written, from the message table; imported when one comes that is not taken while a motion runs.

Forgotten before a motion, as the rows need heap.
"""

from armtempo_board import heap

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any


def by_number() -> "dict[int, Any]":
    """Of each command its name, the formats of its fields and of its answer's, and its tail."""
    from armtempo_shared.table import rows  # here, so that it can be forgotten at once

    kept: "dict[str, str]" = {}  # one string for all that are equal, to save heap
    found = {}
    for (name, number, fields, _, tail), (_, _, values, _, _) in zip(rows("C"), rows("A")):
        found[number] = name, kept.setdefault(fields, fields), kept.setdefault(values, values), tail
    return found


ROWS = by_number()
heap.forget("table")
