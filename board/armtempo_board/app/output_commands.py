"""The commands for outputs and inputs, for an arm that has any; they allocate nothing.

The functions execute a command as those of ``store_commands.py``; the code of a refusal is returned as a
negative number.
"""

from struct import pack_into

from armtempo_shared import codes
from armtempo_shared.messages import PAYLOAD_AT
from micropython import const

_VALUE_AT = const(6)  # in the command: after its number, a byte
_VALUE_HIGH_AT = const(7)
_ANSWER_AT = const(6)  # in a reply
_LEVELS_BYTES = const(1)
_BYTES_PER_VALUE = const(2)

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, Protocol

    from armtempo_board.app.board import Board

    class Caller(Protocol):
        """The caller's interface, see ``commands.Commands``."""

        board: Board
        link: Any


def output(commands: "Caller", row: tuple, length: int) -> int:
    """Set an output."""
    board = commands.board
    data = commands.link.reader.data
    number = data[PAYLOAD_AT]
    if number >= len(board.outputs.values):
        return -codes.NO_OUTPUT
    if board.fault():
        return -codes.FAULT_PENDING
    board.outputs.set(number, data[_VALUE_AT] | data[_VALUE_HIGH_AT] << 8)
    return 0


def inputs_and_outputs(commands: "Caller", row: tuple, length: int) -> int:
    """Answer with the levels of the inputs and the values of the outputs."""
    reply = commands.link.reply
    reply[_ANSWER_AT] = commands.board.inputs.levels
    size = _LEVELS_BYTES
    for value in commands.board.outputs.values:
        pack_into("<H", reply, _ANSWER_AT + size, value)
        size += _BYTES_PER_VALUE
    return size
