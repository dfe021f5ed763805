"""Executes the commands for the store and the drivers; refusals are raised as ``Refused``.

Each function has the name of its command. ``commands``: has the command's fields and takes its answer;
``row``: the command's row in the table of ``Commands``; ``length``: bytes of its payload. It returns the size
of its answer.
"""

from armtempo_shared import codes
from armtempo_shared.messages import ARM_RECORD_NAME, MAX_PAYLOAD, MOTION
from micropython import const

from armtempo_board import features
from armtempo_board.errors import Refused
from armtempo_board.motion import endpoints

_NUMBER_BYTES = const(1)  # of the command, in front of the answer

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Protocol

    from armtempo_board.app.board import Board

    class Caller(Protocol):
        """What is asked of the caller, see ``commands.Commands``."""

        board: Board

        def fields(self, row: tuple) -> tuple: ...

        def tail(self, row: tuple, length: int) -> bytes: ...

        def text(self, row: tuple, length: int) -> str: ...

        def reply(self, row: tuple, *values: int) -> int: ...

        def reply_tail(self, size: int, tail: bytes) -> int: ...


def put_begin(commands: "Caller", row: tuple, length: int) -> None:
    """Begin an upload."""
    size, _ = commands.fields(row)
    commands.board.store().begin(commands.text(row, length), size)


def put_data(commands: "Caller", row: tuple, length: int) -> int:
    """Add a piece to the upload."""
    (offset,) = commands.fields(row)
    return commands.reply(row, commands.board.store().write(offset, commands.tail(row, length)))


def put_commit(commands: "Caller", row: tuple, length: int) -> None:
    """Check the upload and store it; an arm record is used after this has returned."""
    (crc,) = commands.fields(row)
    board = commands.board
    board.arm_record_pending = board.store().commit(crc) == ARM_RECORD_NAME


def put_once(commands: "Caller", row: tuple, length: int) -> int:
    """Add a piece to the motion that is run once."""
    offset, size = commands.fields(row)
    return commands.reply(row, commands.board.once.put(offset, size, commands.tail(row, length)))


def list(commands: "Caller", row: tuple, length: int) -> int:
    """Answer with one of the stored motions and sequences, and their number."""
    (index,) = commands.fields(row)
    store = commands.board.store()
    names = store.names()
    if index >= len(names):
        raise Refused(codes.NOT_FOUND)
    name = names[index]
    crc = duration = joints = kind = 0
    try:
        kind = store.kind(name) if features.SEQUENCES else MOTION
        if kind != MOTION:
            crc = store.opened(name, kind).crc
        else:
            motion = store.motion(name)
            crc, duration, joints = motion.crc, endpoints.duration_ticks(motion), motion.joints
    except Refused:
        crc = 0
    default = name == store.default()
    size = commands.reply(row, len(names), store.size_of(name), crc, duration, joints, default, kind)
    return commands.reply_tail(size, name.encode())


def remove(commands: "Caller", row: tuple, length: int) -> None:
    """Remove a motion."""
    commands.board.store().remove(commands.text(row, length))


def rename(commands: "Caller", row: tuple, length: int) -> None:
    """Give a motion another name."""
    (old_length,) = commands.fields(row)
    names = commands.text(row, length)
    commands.board.store().rename(names[:old_length], names[old_length:])


def get(commands: "Caller", row: tuple, length: int) -> int:
    """Answer with a piece of a record."""
    offset, wanted = commands.fields(row)
    fixed = commands.reply(row, 0)
    wanted = min(wanted, MAX_PAYLOAD - _NUMBER_BYTES - fixed)
    size, data = commands.board.store().part(commands.text(row, length), offset, wanted)
    commands.reply(row, size)
    return commands.reply_tail(fixed, data)


def set_default(commands: "Caller", row: tuple, length: int) -> None:
    """Set the motion that the button starts."""
    commands.board.store().set_default(commands.text(row, length))


def drivers(commands: "Caller", row: tuple, length: int) -> None:
    """Switch the motors' current on or off."""
    (on,) = commands.fields(row)
    board = commands.board
    board.check_ready()
    board.engine.drivers(on)
