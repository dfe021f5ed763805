"""What the board does for each command about the store; refusals are raised as ``Refused``.

Each function is called as the command is. ``row``: its row of the message table, with the formats of its fields and of
its answer's; ``length``: bytes of its payload. It returns the bytes of its answer.
"""

from struct import calcsize

from armtempo_shared import codes
from armtempo_shared.messages import ARM_RECORD_NAME, MAX_PAYLOAD
from armtempo_shared.motion import Motion, MotionError

from armtempo_board.buffers import u32
from armtempo_board.errors import Refused
from armtempo_board.motion import endpoints

TYPE_CHECKING = False
if TYPE_CHECKING:
    from armtempo_board.app.commands import Commands


def put_begin(commands: "Commands", row: tuple, length: int) -> None:
    """Begin an upload."""
    size, _ = commands.fields(row)
    commands.app.store().begin(commands.text(row, length), size)


def put_data(commands: "Commands", row: tuple, length: int) -> int:
    """Add a piece to it."""
    (offset,) = commands.fields(row)
    return commands.reply(row, commands.app.store().write(offset, commands.tail(row, length)))


def put_commit(commands: "Commands", row: tuple, length: int) -> None:
    """Check it and put it in place; an arm record is taken at once."""
    (crc,) = commands.fields(row)
    if commands.app.store().commit(crc) == ARM_RECORD_NAME:
        commands.app.configure()


def list(commands: "Commands", row: tuple, length: int) -> int:
    """One of the stored trajectories, and how many there are."""
    (index,) = commands.fields(row)
    store = commands.app.store()
    names = store.names()
    if index >= len(names):
        raise Refused(codes.NOT_FOUND)
    name = names[index]
    data = store.read(name)
    try:
        motion = Motion(data)
        crc, duration, joints = u32(data, len(data) - 4), endpoints.duration_ticks(motion), motion.joints
    except MotionError:
        crc = duration = joints = 0
    default = name == store.default()
    size = commands.reply(row, len(names), len(data), crc, duration, joints, default)
    return commands.reply_tail(size, name.encode())


def remove(commands: "Commands", row: tuple, length: int) -> None:
    """Remove a trajectory."""
    commands.app.store().remove(commands.text(row, length))


def rename(commands: "Commands", row: tuple, length: int) -> None:
    """Give a trajectory another name."""
    (old_length,) = commands.fields(row)
    names = commands.text(row, length)
    commands.app.store().rename(names[:old_length], names[old_length:])


def get(commands: "Commands", row: tuple, length: int) -> int:
    """A piece of a record."""
    offset, wanted = commands.fields(row)
    wanted = min(wanted, MAX_PAYLOAD - 1 - calcsize(row[2]))
    size, data = commands.app.store().part(commands.text(row, length), offset, wanted)
    return commands.reply_tail(commands.reply(row, size), data)


def set_default(commands: "Commands", row: tuple, length: int) -> None:
    """Make a trajectory the one that the button starts."""
    commands.app.store().set_default(commands.text(row, length))
