"""Reports of a sequence: answers to commands, and events of its rows. Loaded once one is started; allocates nothing."""

from array import array
from struct import calcsize, pack_into

from armtempo_shared.messages import PAYLOAD_AT
from armtempo_shared.table import rows
from micropython import const

from armtempo_board.buffers import copy, pack_offsets

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

_ANSWER = const(2)  # of a command's row: the format of its answer
_ANSWER_AT = const(6)  # in a reply
_MOST = const(0x3FFFFFFF)  # largest value of a counter; a larger number would need memory
ENDING, CODE, STEP, ROW, CYCLE, PASSED, RUN, VALUE = (
    const(0),
    const(1),
    const(2),
    const(3),
    const(4),
    const(5),
    const(6),
    const(7),
)
"""Indices in ``status``: the fields of the messages ``sequence`` and ``row``."""


class SequenceCommand:
    """``status``: state of the sequence, or how it ended; ``name``: its name; ``counters``: names of its counters."""

    def __init__(self, status: "array[int]", name: bytes, counters: "list[bytes]") -> None:
        self._status = status
        self._name = name
        self._counters = counters
        self._counts = array("i", [0] * len(counters))
        self._sent = 0  # number of rows reported to the host
        for event, number, layout, _, _ in rows("E"):
            if event == "row":
                self._number = number
                self._layout = layout
                self._size = calcsize(layout)

    def attach(self, commands: "dict[int, Any]") -> None:
        """Add its commands to the board's commands."""
        for (name, number, fields, _, tail), (_, _, answer, _, _) in zip(rows("S"), rows("T")):
            commands[number] = (getattr(self, name), fields, answer, tail)

    def named(self, name: bytes, most: int) -> int:
        """Number of a counter, added if there are fewer than ``most``; else -1."""
        if name not in self._counters:
            if len(self._counters) == most:
                return -1
            self._counters.append(name)
            self._counts.append(0)
        return self._counters.index(name)

    def count(self, number: int) -> int:
        """Increment a counter; returns its value."""
        self._counts[number] = (self._counts[number] + 1) & _MOST
        return self._counts[number]

    def sequence(self, commands: "Any", row: tuple, length: int) -> int:
        """Answer with its state; returns the size of the answer."""
        status = self._status
        reply = commands.link.reply
        pack_into(
            row[_ANSWER],
            reply,
            _ANSWER_AT,
            status[ENDING],
            status[CODE],
            status[STEP],
            status[ROW],
            status[CYCLE],
        )
        return self._named(reply, row, self._name)

    def counter(self, commands: "Any", row: tuple, length: int) -> int:
        """Answer with the value of a counter; returns the size of the answer."""
        index = commands.link.reader.data[PAYLOAD_AT]
        count = len(self._counts)
        is_one = index < count
        reply = commands.link.reply
        pack_into(row[_ANSWER], reply, _ANSWER_AT, count, self._counts[index] if is_one else 0)
        return self._named(reply, row, self._counters[index] if is_one else b"")

    def _named(self, reply: bytearray, row: tuple, name: bytes) -> int:
        size = calcsize(row[_ANSWER])
        copy(reply, name, pack_offsets(_ANSWER_AT + size, 0), len(name))
        return size + len(name)

    def tell(self, link: "Any") -> None:
        """Send the event of the row that has begun, once, when there is space."""
        status = self._status
        passed = status[PASSED]
        if passed == self._sent or not link.has_space(self._size):
            return
        self._sent = passed
        pack_into(
            self._layout,
            link.out,
            link.payload(),
            passed,
            status[RUN],
            status[ROW],
            status[STEP],
            status[CYCLE],
            status[VALUE],
        )
        link.event(self._number, self._size)
