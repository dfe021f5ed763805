"""A row of a sequence record says nothing beyond what its op has."""

from __future__ import annotations

import struct
from binascii import crc32
from dataclasses import dataclass

import pytest
from armtempo_shared import sequence, sequence_check
from armtempo_shared.sequence import SequenceData, SequenceError

Row = tuple[int, int, int, int, int]
LARGEST = {
    sequence.MOVE: (0, 0),
    sequence.OUTPUT: (65_535, 0),
    sequence.WAIT: (0, 3_600_000),
    sequence.WAIT_INPUT: (1 + 4, 3_600_000),
    sequence.REPEAT: (1, 1_000_000),
    sequence.END: (1, 0),
    sequence.COUNT: (0, 0),
}
"""The most that a row's value and amount may be."""


@dataclass(frozen=True)
class Record:
    """What the check asks of a record: its rows, one motion and one counter."""

    all_rows: tuple[Row, ...]
    motions: int = 1
    counters: int = 1

    @property
    def rows(self) -> int:
        return len(self.all_rows)

    def row(self, index: int) -> Row:
        return self.all_rows[index]

    def motion(self, index: int) -> tuple[str, int]:
        return "a", index

    def counter(self, index: int) -> str:
        return "parts"


def with_row(op: int, value: int, amount: int) -> Record:
    """A record around one row: what is repeated begins and ends."""
    before = ((sequence.REPEAT, 0, 0, 2, 1),) if op == sequence.END else ()
    after = ((sequence.END, 0, 0, 0, 1),) if op == sequence.REPEAT else ()
    return Record((*before, (op, 0, value, amount, 1), *after))


@pytest.mark.parametrize("op", LARGEST)
def test_values_and_amounts_have_their_bounds(op: int) -> None:
    value, amount = LARGEST[op]
    sequence_check.check(with_row(op, value, amount))  # type: ignore[arg-type]
    for beyond in ((value + 1, amount), (value, amount + 1)):
        with pytest.raises(SequenceError, match="row"):
            sequence_check.check(with_row(op, *beyond))  # type: ignore[arg-type]


@pytest.mark.parametrize("op", [0, max(LARGEST) + 1])
def test_other_ops_are_refused(op: int) -> None:
    with pytest.raises(SequenceError):
        sequence_check.check(with_row(op, 0, 0))  # type: ignore[arg-type]


@pytest.mark.parametrize(("magic", "said"), [(b"XXXX", "no sequence record"), (b"ATS1", "another version")])
def test_other_files_are_no_sequence(magic: bytes, said: str) -> None:
    with pytest.raises(SequenceError, match=said):
        SequenceData(magic + bytes(60))


def test_a_record_ends_where_its_header_says() -> None:
    """Also one whose checksum holds for what is too much."""
    data = sequence.pack(0, [(sequence.WAIT, 0, 0, 100, 1)], [])
    SequenceData(data)
    longer = data[:-4] + bytes(9)
    with pytest.raises(SequenceError, match="length does not fit the header"):
        SequenceData(longer + struct.pack("<I", crc32(longer)))


def test_a_motions_name_is_text() -> None:
    head = struct.pack("<4sIHBB", sequence.MAGIC, 0, 1, 1, 0)
    rows = struct.pack("<BBHIH", sequence.MOVE, 0, 0, 0, 1)
    data = head + rows + struct.pack("<24sI", b"\xff" * 24, 0)
    with pytest.raises(SequenceError, match="a motion's name"):
        SequenceData(data + struct.pack("<I", crc32(data))).motion(0)
