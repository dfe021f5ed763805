"""Commands and events over a transport: sequence numbers, time-outs, repeats.

Only one command at a time is in progress, from any thread. Its frame is sent again with the same sequence
number until the board answers; the board acts once on a number and repeats its answer. Events that arrive
meanwhile are queued in ``events``.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from armtempo_shared import wire

from armtempo.basics.errors import ArmtempoError, LinkError, NoAnswerError, OtherBoardError
from armtempo.link import board_messages
from armtempo.link.refusal import refusal
from armtempo.link.transport import Transport
from armtempo.link.turns import Turns

_CTRL_C = 3
REPEAT_INTERVAL_S = 0.2
"""A command is sent again after this time without an answer."""
SILENCE_TIMEOUT_S = 3.0
"""After this time without a byte the board counts as gone."""
ANSWER_TIMEOUT_S = 20.0
"""After this time with bytes but without an answer the link counts as too disturbed."""
FRAME_TIMEOUT_S = 0.05
"""An incomplete frame is dropped after this time without a byte."""
RECONNECT_S = 60.0
"""Time for which opening a broken port is retried."""
STOPPING_RECONNECT_S = 5.0
"""The same after a stop request: long enough to send the stop if the cable is plugged in again."""
REOPEN_INTERVAL_S = 0.2
"""Time between two attempts to open the port."""
RECENT_BYTES = 512
"""Number of received bytes that are kept, to diagnose a port that does not answer."""


Answer = tuple[tuple[Any, ...], Any]
"""Field values (int) and tail (bytes or str) of an answer."""


class Session:
    """The host's end of the protocol; ``clock`` gives seconds and is replaced in tests.

    If the port breaks, ``reopen`` (if set) is called until it returns a transport on which ``greet`` finds the
    same board. Then the command in progress is sent again; ``follow`` requests lost samples. The greeting
    makes the board forget its last answer: if that answer was lost, the board executes the command twice and
    may refuse it the second time.
    """

    def __init__(self, transport: Transport, clock: Callable[[], float] = time.monotonic) -> None:
        self.transport = transport
        self.clock = clock
        self.open_transport: Callable[[], Transport] = lambda: transport
        """Opens the session's port again after it was closed."""
        self.reopen: Callable[[], Transport] | None = None
        self.greet: Callable[[], None] = lambda: None
        """Exchanges ``hello``; raises OtherBoardError if another board answers, or it has restarted."""
        self.tell: Callable[[str], object] = lambda text: None
        """Called with messages for the user while other calls wait."""
        self.stopping: Callable[[], bool] = lambda: False
        """Whether a stop was requested: then a broken port is retried only for STOPPING_RECONNECT_S."""
        self.check: Callable[[], None] = lambda: None
        """Called before the port is used; raises PortError if it is no longer this program's."""
        self.listeners: list[Callable[[board_messages.Event], None]] = []
        """Each is called with every event when it arrives, in the thread that reads the port."""
        self.turns = Turns()
        self.events: deque[board_messages.Event] = deque()
        self.recent = bytearray()
        self.repeats = 0
        self.sleep = time.sleep
        self._parser = wire.Parser()
        self._sequence = 0
        self._woken = False
        self._heard_s = clock()

    @property
    def frames_bad(self) -> int:
        """Number of damaged frames received."""
        return int(self._parser.bad)

    def command(
        self,
        name: str,
        values: Sequence[int] = (),
        tail: bytes | str = b"",
        *,
        silence_timeout_s: float = SILENCE_TIMEOUT_S,
        answer_timeout_s: float = ANSWER_TIMEOUT_S,
    ) -> Answer:
        """Send a command; returns (fields, tail) of the board's answer.

        Raises BoardError if the board refuses, NoAnswerError after ``silence_timeout_s`` without a byte or
        ``answer_timeout_s`` without an answer, LinkError if the port breaks.
        """
        with self.turns:
            return self._command(
                name, wire.encode(wire.COMMAND[name], values, tail), silence_timeout_s, answer_timeout_s
            )

    def _command(
        self, name: str, payload: bytes, silence_timeout_s: float, answer_timeout_s: float
    ) -> Answer:
        number = wire.COMMAND[name][1]
        sequence = self._next_sequence()
        data = wire.frame(sequence, number, payload)
        begin_s = self._heard_s = self.clock()
        while True:
            self._write(data)
            reply = self._reply(self.clock() + REPEAT_INTERVAL_S, sequence, number)
            if reply is not None:
                return _answer(name, reply)
            now_s = self.clock()
            # On a disturbed line every frame may be lost
            silent = now_s - self._heard_s >= silence_timeout_s and not self.frames_bad
            if silent or now_s - begin_s >= answer_timeout_s:
                raise self._no_answer(name, now_s - begin_s)
            self.repeats += 1

    def open_again(self) -> None:
        """Open the port after ``transport.close``; incomplete frames are dropped."""
        self._parser = wire.Parser()
        self.transport = self.open_transport()

    def poll(self, timeout_s: float) -> board_messages.Event | None:
        """The oldest event; None if none arrives within ``timeout_s`` or before ``wake``."""
        deadline_s = self.clock() + timeout_s
        while not self.events:
            left_s = deadline_s - self.clock()
            with self.turns:
                frame = self._frame(max(0.0, left_s))
                if frame is not None:
                    self._keep_event(frame)
            if frame is None and (left_s <= 0 or self._woken):
                self._woken = False
                return None
        return self.events.popleft()

    def wake(self) -> None:
        """Make a waiting ``poll`` return at once; for other threads and signal handlers."""
        self._woken = True
        self.transport.wake()

    @contextmanager
    def in_a_hurry(self, timeout_s: float) -> Iterator[bool]:
        """The next turn to talk to the board, for a request of another program; see ``Turns.in_a_hurry``."""
        self.transport.wake()
        with self.turns.in_a_hurry(timeout_s) as mine:
            yield mine

    def _no_answer(self, name: str, waited_s: float) -> NoAnswerError:
        problem = f"the board on {self.transport.name} did not answer '{name}' within {waited_s:.1f} s"
        if self.frames_bad:
            problem += f", and messages arrived damaged ({self.frames_bad} times)"
            return NoAnswerError(problem, "check cable and plugs, or try another cable")
        return NoAnswerError(problem, "check the cable and that the board is powered")

    def _next_sequence(self) -> int:
        """The next sequence number; skips 3, which a starting board would take for Ctrl-C."""
        self._sequence = (self._sequence + (2 if self._sequence == _CTRL_C - 1 else 1)) % 256
        return self._sequence

    def _reply(self, deadline_s: float, sequence: int, number: int) -> wire.Frame | None:
        while (left_s := deadline_s - self.clock()) > 0:
            frame = self._frame(left_s)
            if frame is None:
                continue
            if frame.number in _REPLY_IDS:
                if frame.sequence == sequence and frame.payload[:1] == bytes((number,)):
                    return frame
            else:
                self._keep_event(frame)
        return None

    def _frame(self, timeout_s: float) -> wire.Frame | None:
        frame = self._next_frame()
        if frame is not None:
            return frame
        data = self._read(min(timeout_s, FRAME_TIMEOUT_S))
        if data:
            self._heard_s = self.clock()
            self.recent = (self.recent + data)[-RECENT_BYTES:]
            self._parser.feed(data)
        elif self._parser.pending() and self.clock() - self._heard_s >= FRAME_TIMEOUT_S:
            self._parser.drop()
        return self._next_frame()

    def _write(self, data: bytes) -> None:
        self.check()
        try:
            self.transport.write(data)
        except LinkError as error:
            self.reconnect(error)

    def _read(self, timeout_s: float) -> bytes:
        self.check()
        try:
            return self.transport.read(timeout_s)
        except LinkError as error:
            self.reconnect(error)
            return b""

    def reconnect(self, reason: LinkError) -> None:
        """Close the port and open it again until the board answers, for up to RECONNECT_S.

        Raises ``reason`` if that fails, OtherBoardError if another board answers.
        """
        self.check()
        if self.reopen is None:
            raise reason
        self.tell(f"{reason.problem}; waiting for it to come back")
        self.transport.close()
        limit_s = self.clock() + RECONNECT_S
        while not self._found_again(self.reopen):
            self.check()
            if self.stopping():
                limit_s = min(limit_s, self.clock() + STOPPING_RECONNECT_S)
            if self.clock() >= limit_s:
                raise self._gone(reason)
            self.sleep(REOPEN_INTERVAL_S)
        self._heard_s = self.clock()
        self.tell(f"connected to {self.transport.name} again")

    def _gone(self, reason: LinkError) -> LinkError:
        if not self.stopping():
            return reason
        return LinkError(
            f"{reason.problem}; no stop could be sent: a motion may still be running",
            "see 'armtempo status' once it is back",
        )

    def _found_again(self, reopen: Callable[[], Transport]) -> bool:
        """Open the port and greet the board; False if that fails."""
        self._parser = wire.Parser()
        self.reopen = None  # the caller repeats a command that fails meanwhile
        try:
            self.transport = reopen()
            self.greet()
            return True
        except OtherBoardError:
            raise
        except ArmtempoError:
            self.transport.close()
            return False
        finally:
            self.reopen = reopen

    def _next_frame(self) -> wire.Frame | None:
        frame: wire.Frame | None = self._parser.next()
        return frame

    def _keep_event(self, frame: wire.Frame) -> None:
        try:
            event = board_messages.event(frame.number, frame.payload)
        except wire.WireError:
            return  # a reply to an older command, or a message of a newer protocol
        self.events.append(event)
        for listener in self.listeners:
            listener(event)


_REPLY_IDS = tuple(wire.EVENT[name][1] for name in ("ok", "error"))


def _answer(name: str, reply: wire.Frame) -> Answer:
    try:
        values, tail = wire.decode(wire.EVENT_BY_ID[reply.number], reply.payload)
        if wire.EVENT_BY_ID[reply.number][0] == "error":
            raise refusal(f"the board refused '{name}'", *values[1:])
        answer: Answer = board_messages.decode(wire.ANSWER[name], tail)
    except wire.WireError as error:
        raise LinkError(
            f"the board's answer to '{name}' does not fit protocol {wire.PROTOCOL_VERSION} ({error})",
            "run 'armtempo deploy'",
        ) from error
    return answer
