"""A sequence or a user's program on the board: start it, follow it to its end."""

from __future__ import annotations

from collections.abc import Callable

from armtempo_shared.program import SUFFIX
from armtempo_shared.wire import ERROR_CODES

from armtempo.basics.errors import BoardError
from armtempo.encoding.encoded_motion import MotionKey
from armtempo.link import Client
from armtempo.link.board_messages import SequenceState
from armtempo.link.follow import Followed, SequenceFollower, SequenceWatcher, where
from armtempo.link.refusal import refusal
from armtempo.robot import stored_motion
from armtempo.robot.stop_request import StopRequest


def run(
    client: Client,
    key: MotionKey,
    stop: StopRequest,
    watcher: SequenceWatcher = lambda _: None,
    take: Callable[[Followed], object] = lambda _: None,
    program: bool = False,
) -> SequenceFollower:
    """Start a stored sequence (or ``program``) and follow it to its end; see ``stored_motion.follow``.

    Raises BoardError if the board refuses to start.
    """

    def start() -> SequenceFollower:
        before = client.start(key.name, key.crc).run
        return SequenceFollower(client, key.name + SUFFIX if program else key.name, before, watcher)

    return stored_motion.follow(client, stop, start, take)


def raise_failure(client: Client, end: SequenceState, program: bool = False) -> None:
    """Raise BoardError if a fault ended a sequence (or ``program``), or the board refused one of its motions."""
    what, place = ("program", f"in line {end.step}") if program else ("sequence", where(end))
    if end.ending == "fault" and program and end.code == ERROR_CODES["underrun"]:
        raise BoardError(
            f"the program kept the board from its work {place} or after it, so that the steps ran out; the "
            "position is known",
            "let it call the cell while the arm moves, such as cell.sleep(0.001); then 'armtempo clear'",
            end.code,
        )
    if end.ending == "fault":
        raise refusal(f"a fault ended the {what} {place}", end.code, client.status().fault_joint)
    if end.ending == "refused":
        raise refusal(f"the {what} could not continue {place}", end.code)
