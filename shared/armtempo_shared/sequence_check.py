"""Checks of a sequence record, before it is stored, and again before it is run."""

from armtempo_shared import sequence
from armtempo_shared.sequence import SequenceError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from armtempo_shared.sequence import SequenceRecord

_MOST_VALUES = (0, 0, 0xFFFF, 0, sequence.ACTIVE | sequence.NEXT_THEN, 1, 1, 0)
_MOST_AMOUNTS = (0, 0, 0, sequence.MAX_WAIT_MS, sequence.MAX_WAIT_MS, sequence.MAX_REPEATS, 0, 0)
"""Largest amount of a row by its op."""


def check(record: "SequenceRecord") -> None:
    """Raise SequenceError, with the row, for an invalid record."""
    depth = 0
    # the numbers of outputs and inputs are checked with the arm
    most_numbers = (0, record.motions - 1, 0xFF, 0, 0xFF, 0, 0, record.counters - 1)
    for index in range(record.rows):
        op, number, value, amount, step = record.row(index)
        depth += (op == sequence.REPEAT) - (op == sequence.END)
        if (
            not sequence.MOVE <= op <= sequence.COUNT
            or number > most_numbers[op]
            or value > _MOST_VALUES[op]
            or amount > _MOST_AMOUNTS[op]
            or not step
            or not 0 <= depth <= sequence.MAX_NESTING
        ):
            raise SequenceError("row %d" % index)
    if depth:
        raise SequenceError("a repeat without its end")
    for index in range(record.motions):
        name, _ = record.motion(index)
        if not name:
            raise SequenceError("motion %d" % index)
    for index in range(record.counters):
        if not record.counter(index):
            raise SequenceError("counter %d" % index)
