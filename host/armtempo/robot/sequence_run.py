"""A sequence or a user's program on the board: store it with its motions, start it, follow it to its end."""

from __future__ import annotations

from collections.abc import Callable

from armtempo_shared import sequence as record
from armtempo_shared.program import SUFFIX
from armtempo_shared.wire import ERROR_CODES

from armtempo.basics.errors import BoardError, LinkError, OtherBoardError
from armtempo.basics.progress import Progress
from armtempo.encoding import flash_use
from armtempo.encoding.encoded_motion import MotionKey
from armtempo.encoding.encoded_program import EncodedProgram
from armtempo.encoding.encoded_sequence import EncodedSequence
from armtempo.link import Client
from armtempo.link.board_messages import Event, SequenceState, StoredMotion
from armtempo.link.refusal import refusal
from armtempo.model.steps import position
from armtempo.robot import stored_motion
from armtempo.robot.stop_request import StopRequest

LOOK_S = 0.1
"""Interval at which the board is asked for the state."""
SequenceWatcher = Callable[[SequenceState], object]
"""Called with the state of the sequence or program at each change."""


def store(
    client: Client,
    encoded: EncodedSequence | EncodedProgram,
    progress: Progress | None = None,
    replace: bool = False,
) -> MotionKey:
    """Store a sequence or program, its motions first, so that what is stored is always complete.

    Motions of an earlier sequence of this name that are no longer needed are removed. Raises LinkError if the
    board has too little flash, or memory for a program, or other content under one of the names and ``replace`` is
    false; a program replaces one of its name.
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
    _check_flash(client, records, kept)
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


def _check_flash(
    client: Client, records: list[tuple[MotionKey, bytes]], kept: dict[str, StoredMotion]
) -> None:
    """Raise LinkError if the flash cannot take all records, each of which is written before an old one is removed."""
    new = [
        (key.name, len(data))
        for key, data in records
        if key.name not in kept or kept[key.name].crc != key.crc
    ]
    free = whole = client.hello().free_flash
    free -= flash_use.of_names([name for name, _ in new if name not in kept])
    fits = True
    for name, size in new:
        fits = fits and size + flash_use.BLOCK <= free
        free -= flash_use.in_blocks(size) - (flash_use.in_blocks(kept[name].size) if name in kept else 0)
    if not fits:
        raise LinkError(
            f"{len(new)} records take {whole - free + flash_use.BLOCK} bytes of the board's flash, of which {whole} "
            "are free; nothing was stored",
            "remove what is not needed ('armtempo list', 'armtempo remove'), or plan fewer motions, such as for a "
            "part of the pallet",
        )


def _legs_of(client: Client, old: StoredMotion) -> dict[str, int]:
    """Names and checksums of the motions of a stored sequence; empty if it cannot be read."""
    try:
        found = record.SequenceData(client.fetch(old.name))
        return dict(found.motion(index) for index in range(found.motions))
    except record.SequenceError:
        return {}


class Events:
    """Takes the board's events of a run, and its end; override what you need."""

    def take(self, event: Event) -> None:
        """Handle an event."""

    def end(self, state: SequenceState) -> None:
        """The sequence or program has ended, in whatever way."""


def run(
    client: Client,
    key: MotionKey,
    stop: StopRequest,
    watcher: SequenceWatcher = lambda _: None,
    events: Events | None = None,
    program: bool = False,
) -> SequenceState:
    """Start a stored sequence (or ``program``) and follow it to its end; a stop request makes the board brake and end.

    ``events`` gets the board's events and the end. If the connection breaks, the board continues by itself,
    and the host tries to reconnect for RECONNECT_S. Raises BoardError if the board refuses to start or a
    fault ends it, LinkError if it cannot be reached any more.
    """
    with stored_motion.Supervision(client, stop) as supervision:
        client.start(key.name, key.crc)
        name = key.name + SUFFIX if program else key.name
        follow = _Following(client, name, supervision, watcher, events or Events())
        end = supervision.follow(follow.to_its_end)
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
    return end


class _Following:
    """Follows a running sequence or program; continues where it was after the link was lost."""

    def __init__(
        self,
        client: Client,
        name: str,
        supervision: stored_motion.Supervision,
        watcher: SequenceWatcher,
        events: Events,
    ) -> None:
        self._client = client
        self._name = name
        self._supervision = supervision
        self._watcher = watcher
        self._events = events
        self._before: SequenceState | None = None

    def to_its_end(self) -> SequenceState:
        """The last state."""
        while (state := self._next_state()).ending == "running":
            _take_events(self._client, self._events)
        _take_events(self._client, self._events)
        self._events.end(state)
        return state

    def _next_state(self) -> SequenceState:
        self._supervision.brake()
        state = self._client.sequence()
        self._supervision.heard()
        if state.name != self._name or state.ending == "none":
            last = f"; last known state: {where(self._before)}" if self._before else ""
            raise OtherBoardError(
                f"the board has restarted during the run: positions are unknown{last}",
                "move the arm to its home posture and run 'armtempo home'",
            )
        if state != self._before:
            self._before = state
            self._watcher(state)
        return state


def _take_events(client: Client, events: Events) -> None:
    """Pass on the board's events for LOOK_S; a stop request ends that early."""
    until_s = client.session.clock() + LOOK_S
    while (left_s := until_s - client.session.clock()) > 0:
        event = client.session.poll(left_s)
        if event is None:
            return
        events.take(event)


def where(state: SequenceState) -> str:
    """Describe step and cycle."""
    return f"in {position(state.step, state.cycle)}"
