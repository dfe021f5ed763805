"""What a sequence record must keep besides its checksum: before it is stored, and again before it is run."""

from armtempo_shared import sequence
from armtempo_shared.sequence import SequenceError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from armtempo_shared.sequence import SequenceRecord

_MOST_VALUES = (0, 0, 0xFFFF, 0, sequence.ACTIVE | sequence.NEXT_THEN, 1, 1, 0)
_MOST_AMOUNTS = (0, 0, 0, sequence.MAX_WAIT_MS, sequence.MAX_WAIT_MS, sequence.MAX_REPEATS, 0, 0)
"""The most that a row's value and amount may be, by its op."""


def check(record: "SequenceRecord") -> None:
    """SequenceError with the row that is not understood: nothing of such a record may be run."""
    depth = 0
    for index in range(record.rows):
        op, number, value, amount, step = record.row(index)
        if (
            not sequence.MOVE <= op <= sequence.COUNT
            or value > _MOST_VALUES[op]
            or amount > _MOST_AMOUNTS[op]
        ):
            raise SequenceError("row %d" % index)
        if op == sequence.MOVE:
            known = number < record.motions
        elif op == sequence.COUNT:
            known = number < record.counters
        elif op in (sequence.OUTPUT, sequence.WAIT_INPUT):
            known = True  # the arm says how many there are
        else:
            known = number == 0
        if not known or not step:
            raise SequenceError("row %d" % index)
        depth += (op == sequence.REPEAT) - (op == sequence.END)
        if not 0 <= depth <= sequence.MAX_NESTING:
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
