"""A user's program on the board: store it with its motions, start it, follow it to its end."""

from __future__ import annotations

from collections.abc import Callable

from armtempo_shared.program import SUFFIX
from armtempo_shared.wire import ERROR_CODES

from armtempo.basics.errors import BoardError, LinkError
from armtempo.basics.progress import Progress
from armtempo.encoding.encoded_motion import MotionKey
from armtempo.encoding.encoded_program import EncodedProgram
from armtempo.link import Client
from armtempo.link.board_messages import Event, Notice, SequenceState
from armtempo.link.refusal import refusal
from armtempo.robot import sequence_run, stored_motion
from armtempo.robot.sequence_run import SequenceWatcher
from armtempo.robot.stop_request import StopRequest

Listener = Callable[[str], object]
"""Called with each line that the program prints, and with the traceback of a failure."""


def store(
    client: Client, encoded: EncodedProgram, progress: Progress | None = None, replace: bool = False
) -> MotionKey:
    """Store a program, its motions first.

    Raises LinkError if the board has too little memory for it, or has other content under one of the names and
    ``replace`` is false.
    """
    name = encoded.program.name
    client.need("sequences", f"program {name!r}")
    free = client.hello().free_heap  # 0: a virtual board on CPython
    if 0 < free < encoded.heap_bytes:
        raise LinkError(
            f"program {name!r} needs {encoded.heap_bytes} bytes of the board's memory, with this arm {free} are free",
            "make it shorter; with the program in the firmware more is free: 'armtempo flash'",
        )
    for motion in encoded.motions:
        stored_motion.store(client, motion.name, motion.data, progress, replace)
    found = client.find(name)
    if found is None or found.crc != encoded.key.crc:
        if found is not None and not found.program and not replace:
            raise LinkError(
                f"the board has something else as {name!r} (checksum {found.crc:08x})",
                "replace it with --force, or give the program's file another name",
            )
        client.upload(name, encoded.data, progress)
    return encoded.key


class _Notices:
    """Takes the board's events of a run: passes on its texts."""

    def __init__(self, listener: Listener) -> None:
        self._listener = listener

    def take(self, event: Event) -> None:
        """An event."""
        if isinstance(event, Notice):
            self._listener(event.text)

    def end(self, state: SequenceState) -> None:
        """The end."""


def run(
    client: Client,
    key: MotionKey,
    stop: StopRequest,
    listener: Listener,
    watcher: SequenceWatcher = lambda _: None,
) -> SequenceState:
    """Start a stored program and follow it to its end; a stop request makes the board brake and end it.

    If the connection breaks, the board continues by itself, and the host tries to reconnect. Raises BoardError if the
    board refuses to start or a fault ends the program, LinkError if it cannot be reached any more.
    """
    with stored_motion.Supervision(client, stop) as supervision:
        client.start(key.name, key.crc)
        follow = sequence_run.Following(client, key.name + SUFFIX, supervision, watcher, _Notices(listener))
        end = supervision.follow(follow.to_its_end)
    if end.ending == "fault" and end.code == ERROR_CODES["underrun"]:
        raise BoardError(
            f"the program kept the board from its work in line {end.step} or after it, so that the steps ran out; the "
            "position is known",
            "let it call the cell while the arm moves, such as cell.sleep(0.001); then 'armtempo clear'",
            end.code,
        )
    if end.ending == "fault":
        raise refusal(f"a fault ended the program in line {end.step}", end.code, client.status().fault_joint)
    return end
