"""The command about the sequence, for a board on which one has been started; it allocates nothing."""

from struct import pack_into

from micropython import const

from armtempo_board.buffers import copy, pack_offsets

TYPE_CHECKING = False
if TYPE_CHECKING:
    from array import array
    from typing import Any

_ANSWER = const(2)  # of a command's row: the format of its answer
_ANSWER_AT = const(6)  # in a reply
_BYTES = const(10)  # of that format
ENDING, CODE, STEP, ROW, CYCLE = const(0), const(1), const(2), const(3), const(4)
"""Places in what is told."""


class SequenceCommand:
    """``told``: how the sequence stands or ended; ``name``: which it is."""

    def __init__(self, told: "array[int]", name: bytes) -> None:
        self._told = told
        self._name = name

    def attach(self, commands: "dict[int, Any]") -> None:
        """Put it among the commands that the board knows."""
        from armtempo_shared.table import rows  # here, so that it can be forgotten

        (_, number, fields, _, tail), (_, _, answer, _, _) = rows("S") + rows("T")
        commands[number] = (self.answer, fields, answer, tail)

    def answer(self, commands: "Any", row: tuple, length: int) -> int:
        """Acts on the command: bytes of its answer."""
        told = self._told
        reply = commands.link.reply
        pack_into(
            row[_ANSWER], reply, _ANSWER_AT, told[ENDING], told[CODE], told[STEP], told[ROW], told[CYCLE]
        )
        copy(reply, self._name, pack_offsets(_ANSWER_AT + _BYTES, 0), len(self._name))
        return _BYTES + len(self._name)
