"""A sequence on the board: store it with its motions, start it, follow it to its end."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from armtempo_shared import sequence as record
from armtempo_shared import wire

from armtempo.basics.errors import LinkError, OtherBoardError
from armtempo.basics.progress import Progress
from armtempo.encoding.encoded_motion import MotionKey
from armtempo.encoding.encoded_sequence import EncodedSequence
from armtempo.link import Client
from armtempo.link.board_messages import Event, SequenceState, StoredMotion
from armtempo.link.refusal import refusal
from armtempo.model.steps import position
from armtempo.robot import stored_motion
from armtempo.robot.sequence_recording import Recorder
from armtempo.robot.stop_request import StopRequest

LOOK_S = 0.1
"""Interval at which the board is asked for the sequence's state."""
SequenceWatcher = Callable[[SequenceState], object]
"""Called with the state of the sequence at each change."""


@dataclass(frozen=True)
class _Record:
    name: str
    data: bytes

    @property
    def crc(self) -> int:
        return wire.record_crc(self.data)


def store(
    client: Client, encoded: EncodedSequence, progress: Progress | None = None, replace: bool = False
) -> MotionKey:
    """Store a sequence, its motions first, so that a stored sequence is always complete.

    Motions of an earlier sequence of this name that are no longer needed are removed. Raises LinkError if the
    board has other content under one of the names and ``replace`` is false.
    """
    client.need("sequences", f"sequence {encoded.plan.name!r}")
    kept = {entry.name: entry for entry in client.stored()}
    old = kept.get(encoded.plan.name)
    legs = _legs_of(client, old) if old and old.sequence else {}
    records = [_Record(one.name, one.data) for one in encoded.motions]
    records.append(_Record(encoded.plan.name, encoded.data))
    if not replace:
        for one in records:
            entry = kept.get(one.name)
            if entry and entry.crc not in (0, one.crc, legs.get(one.name)):
                raise LinkError(
                    f"the board has something else as {one.name!r} (checksum {entry.crc:08x})",
                    "replace it with --force, or give the sequence another name",
                )
    whole, done = sum(len(one.data) for one in records), 0
    for one in records:
        if one.name not in kept or kept[one.name].crc != one.crc:
            client.upload(one.name, one.data)
        done += len(one.data)
        if progress is not None:
            progress(done, whole)
    for name in legs.keys() - {one.name for one in records}:
        if name in kept and kept[name].crc == legs[name]:
            client.remove(name)
    return encoded.key


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
    recorder: Recorder | None = None,
) -> SequenceState:
    """Start a stored sequence and follow it to its end; a stop request makes the board brake and end it.

    ``recorder`` gets the board's events and the end. If the connection breaks, the board continues by itself,
    and the host tries to reconnect for RECONNECT_S. Raises BoardError if the board refuses to start or a
    fault ends the sequence, LinkError if it cannot be reached any more.
    """
    with stored_motion.Supervision(client, stop) as supervision:
        client.start(key.name, key.crc)
        follow = Following(client, key.name, supervision, watcher, recorder or Recorder())
        end = supervision.follow(follow.to_its_end)
    if end.ending == "fault":
        raise refusal(f"a fault ended the sequence {where(end)}", end.code, client.status().fault_joint)
    if end.ending == "refused":
        raise refusal(f"the sequence could not continue {where(end)}", end.code)
    return end


class Takes(Protocol):
    """What takes the events of a run, and its end."""

    def take(self, event: Event) -> None: ...

    def end(self, state: SequenceState) -> None: ...


class Following:
    """Follows a running sequence or program; continues where it was after the link was lost."""

    def __init__(
        self,
        client: Client,
        name: str,
        supervision: stored_motion.Supervision,
        watcher: SequenceWatcher,
        recorder: Takes,
    ) -> None:
        self._client = client
        self._name = name
        self._supervision = supervision
        self._watcher = watcher
        self._recorder = recorder
        self._before: SequenceState | None = None

    def to_its_end(self) -> SequenceState:
        """The last state."""
        while (state := self._next_state()).ending == "running":
            _take_events(self._client, self._recorder)
        _take_events(self._client, self._recorder)
        self._recorder.end(state)
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


def _take_events(client: Client, recorder: Takes) -> None:
    """Pass on the board's events for LOOK_S; a stop request ends that early."""
    until_s = client.session.clock() + LOOK_S
    while (left_s := until_s - client.session.clock()) > 0:
        event = client.session.poll(left_s)
        if event is None:
            return
        recorder.take(event)


def where(state: SequenceState) -> str:
    """Describe step and cycle."""
    return f"in {position(state.step, state.cycle)}"
