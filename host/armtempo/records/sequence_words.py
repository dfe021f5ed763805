"""What the rows of a sequence record do, in words: of one whose file is not at hand."""

from __future__ import annotations

from collections.abc import Sequence

from armtempo_shared import sequence
from armtempo_shared.sequence import ACTIVE, FAULT_THEN, NEXT_THEN, SequenceData

_THEN = {NEXT_THEN: "next", FAULT_THEN: "fault"}


def of_record(record: SequenceData, outputs: Sequence[str], inputs: Sequence[str]) -> tuple[str, ...]:
    """One text a row; ``outputs``, ``inputs``: their names by their number, as the arm has them."""
    return tuple(_words(record, record.row(index), outputs, inputs) for index in range(record.rows))


def _words(record: SequenceData, row: tuple[int, ...], outputs: Sequence[str], inputs: Sequence[str]) -> str:
    op, number, value, amount, _ = row
    if op == sequence.MOVE:
        return f"run {record.motion(number)[0]}"
    if op == sequence.OUTPUT:
        return f"output {_name(outputs, number)} to {value} of 65535"
    if op == sequence.WAIT:
        return f"wait {amount / 1000:g} s"
    if op == sequence.WAIT_INPUT:
        limit = f", at most {amount / 1000:g} s, then {_THEN.get(value & ~ACTIVE, 'stop')}" if amount else ""
        return f"wait for input {_name(inputs, number)}{'' if value & ACTIVE else ' not'}{limit}"
    if op == sequence.REPEAT:
        return f"repeat {amount} times" if amount else "repeat for ever"
    if op == sequence.COUNT:
        return f"count {record.counter(number).decode(errors='replace')}"
    return "end of repeat"


def _name(names: Sequence[str], number: int) -> str:
    return names[number] if number < len(names) else str(number + 1)
