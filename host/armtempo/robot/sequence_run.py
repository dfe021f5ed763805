"""A sequence or a user's program on the board: store it with its motions, start it, follow it to its end."""

from __future__ import annotations

from collections.abc import Callable

from armtempo_shared import sequence as record
from armtempo_shared.program import SUFFIX
from armtempo_shared.wire import ERROR_CODES

from armtempo.basics.errors import BoardError, LinkError
from armtempo.basics.progress import Progress
from armtempo.encoding.encoded_motion import MotionKey
from armtempo.encoding.encoded_program import EncodedProgram
from armtempo.encoding.encoded_sequence import EncodedSequence
from armtempo.link import Client
from armtempo.link.board_messages import SequenceState, StoredMotion
from armtempo.link.follow import Followed, SequenceFollower, SequenceWatcher, where
from armtempo.link.refusal import refusal
from armtempo.robot import stored_motion
from armtempo.robot.stop_request import StopRequest


def store(
    client: Client,
    encoded: EncodedSequence | EncodedProgram,
    progress: Progress | None = None,
    replace: bool = False,
) -> MotionKey:
    """Store a sequence or program, its motions first, so that what is stored is always complete.

    Motions of an earlier sequence of this name that are no longer needed are removed. Raises LinkError if the
    board has too little memory for a program, or other content under one of the names and ``replace`` is false; a
    program replaces one of its name.
    """
    key = encoded.key
    kind, named = ("program", "program's file") if isinstance(encoded, EncodedProgram) else ("sequence",) * 2
    client.need("sequences", f"{kind} {key.name!r}")
    if isinstance(encoded, EncodedProgram):
        _check_memory(client, encoded)
    kept = {entry.name: entry for entry in client.stored()}
    old = kept.get(key.name)
    legs = _legs_of(client, old) if old and old.sequence else {}
    records = [(motion.key, motion.data) for motion in encoded.motions] + [(key, encoded.data)]
    for one, _ in records if not replace else ():
        entry = kept.get(one.name)
        earlier = kind == "program" and one is key and entry and entry.program
        if entry and entry.crc not in (0, one.crc, legs.get(one.name)) and not earlier:
            raise LinkError(
                f"the board has something else as {one.name!r} (checksum {entry.crc:08x})",
                f"replace it with --force, or give the {named} another name",
            )
    whole, done = sum(len(data) for _, data in records), 0
    for one, data in records:
        if one.name not in kept or kept[one.name].crc != one.crc:
            client.upload(one.name, data)
        done += len(data)
        if progress is not None:
            progress(done, whole)
    for name in legs.keys() - {one.name for one, _ in records}:
        if name in kept and kept[name].crc == legs[name]:
            client.remove(name)
    return key


def _check_memory(client: Client, encoded: EncodedProgram) -> None:
    free = client.hello().free_heap  # 0: a virtual board on CPython
    if 0 < free < encoded.heap_bytes:
        raise LinkError(
            f"program {encoded.key.name!r} needs {encoded.heap_bytes} bytes of the board's memory, with this arm "
            f"{free} are free",
            "make it shorter; with the program in the firmware more is free: 'armtempo flash'",
        )


def _legs_of(client: Client, old: StoredMotion) -> dict[str, int]:
    """Names and checksums of the motions of a stored sequence; empty if it cannot be read."""
    try:
        found = record.SequenceData(client.fetch(old.name))
        return dict(found.motion(index) for index in range(found.motions))
    except record.SequenceError:
        return {}


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
