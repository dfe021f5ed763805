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
from dataclasses import dataclass
from typing import Any

from armtempo_shared import wire

from armtempo.basics.errors import ArmtempoError, LinkError, NoAnswerError, OtherBoardError
from armtempo.link import board_messages
from armtempo.link.board_lock import BoardLock
from armtempo.link.refusal import refusal
from armtempo.link.transport import Transport

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


@dataclass(frozen=True, eq=False)
class OnLoss:
    """What to do if the port breaks, for ``Session.on_loss``."""

    retry_s: float = RECONNECT_S
    """How long opening it is retried; 0: the error is raised at once."""
    stopping: Callable[[], bool] = lambda: False
    """Whether a stop is wanted: then it is retried only for STOPPING_RECONNECT_S, and the error says that no
    stop was sent."""


class Session:
    """The host's end of the protocol.

    ``clock`` gives seconds and ``sleep`` lets them pass; both are replaced in tests. ``reopen`` opens the port
    again after it was closed; ``comes_back``: whether a port that breaks is waited for; ``tell`` is called with
    messages for the user while other calls wait.

    If the port breaks, ``reopen`` is called until it returns a transport on which the board that was greeted
    answers (``greeted``). Then the command in progress is sent again; ``follow`` requests lost samples. The
    greeting makes the board forget its last answer: if that answer was lost, the board executes the command
    twice and may refuse it the second time.
    """

    def __init__(
        self,
        transport: Transport,
        clock: Callable[[], float] = time.monotonic,
        *,
        reopen: Callable[[], Transport] | None = None,
        comes_back: bool = True,
        tell: Callable[[str], object] = lambda text: None,
        sleep: Callable[[float], object] = time.sleep,
    ) -> None:
        self.transport = transport
        self.clock = clock
        self.lock = BoardLock()
        self.events: deque[board_messages.Event] = deque()
        self.recent = bytearray()
        self.repeats = 0
        self._reopen = reopen
        self._comes_back = comes_back
        self._tell = tell
        self._sleep = sleep
        self._greet: Callable[[], None] | None = None
        self._reconnecting = False
        self._guards: list[Callable[[], None]] = []
        self._listeners: list[Callable[[board_messages.Event], None]] = []
        self._on_loss: list[OnLoss] = [OnLoss()]
        self._parser = wire.Parser()
        self._sequence = 0
        self._woken = False
        self._heard_s = clock()
        self._connected_s = self._heard_s
        """When the port was opened last."""

    def greeted(self, greet: Callable[[], None]) -> None:
        """The board has answered ``hello``: from now on a port that breaks is opened again.

        ``greet`` exchanges ``hello`` again; raises OtherBoardError if another board answers, or it has restarted.
        """
        self._greet = greet

    def listen(self, listener: Callable[[board_messages.Event], None]) -> None:
        """Call ``listener`` with every event when it arrives, in the thread that reads the port."""
        self._listeners.append(listener)

    def guard(self, check: Callable[[], None]) -> None:
        """Call ``check`` before each use of the port; it raises LinkError if the port is no longer this program's."""
        self._guards.append(check)

    @contextmanager
    def on_loss(self, what: OnLoss) -> Iterator[None]:
        """What to do if the port breaks within this context, in any thread; of several the shortest retry counts."""
        self._on_loss.append(what)
        try:
            yield
        finally:
            self._on_loss.remove(what)

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
        _, number, *_ = entry = wire.COMMAND[name]
        with self.lock:
            sequence = self._next_sequence()
            data = wire.frame(sequence, number, wire.encode(entry, values, tail))
            begin_s = self._heard_s = self.clock()
            while True:
                self._write(data)
                reply = self._reply(self.clock() + REPEAT_INTERVAL_S, sequence, number)
                if reply is not None:
                    return _answer(name, reply)
                now_s = self.clock()
                # On a disturbed line every frame may be lost
                silent = now_s - self._heard_s >= silence_timeout_s and not self.frames_bad
                waited_s = now_s - max(begin_s, self._connected_s)
                if silent or waited_s >= answer_timeout_s:
                    raise self._no_answer(name, waited_s)
                self.repeats += 1

    def open_again(self) -> None:
        """Open the port after ``transport.close``; incomplete frames are dropped."""
        self._parser = wire.Parser()
        if self._reopen is not None:
            self.transport = self._reopen()

    def poll(self, timeout_s: float) -> board_messages.Event | None:
        """The oldest event; None if none arrives within ``timeout_s`` or before ``wake``."""
        deadline_s = self.clock() + timeout_s
        while not self.events:
            left_s = deadline_s - self.clock()
            with self.lock:
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
    def in_a_hurry(self, timeout_s: float, stops: bool = False) -> Iterator[bool]:
        """The lock next, for a request from another thread; see ``BoardLock.in_a_hurry``."""
        self.transport.wake()
        with self.lock.in_a_hurry(timeout_s, stops) as mine:
            yield mine

    @contextmanager
    def by_turns(self, timeout_s: float) -> Iterator[bool]:
        """The next commands, for a request from another thread; see ``BoardLock.by_turns``."""
        self.transport.wake()
        with self.lock.by_turns(timeout_s) as mine:
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
        self._check()
        try:
            self.transport.write(data)
        except LinkError as error:
            self.reconnect(error)

    def _read(self, timeout_s: float) -> bytes:
        self._check()
        try:
            return self.transport.read(timeout_s)
        except LinkError as error:
            self.reconnect(error)
            return b""

    def reconnect(self, reason: LinkError) -> None:
        """Close the port and open it again until the board answers, for as long as ``on_loss`` says.

        Raises ``reason`` if that fails, OtherBoardError if another board answers.
        """
        with self.lock:
            self._check()
            if self._greet is None or self._reconnecting or not self._retry_s():
                raise reason  # whoever reconnects repeats a command that fails meanwhile
            self._tell(f"{reason.problem}; waiting for it to come back")
            self.transport.close()
            self._reconnecting = True
            try:
                self._wait_for_board(self._greet, reason)
            finally:
                self._reconnecting = False
            self._heard_s = self._connected_s = self.clock()
            self._tell(f"connected to {self.transport.name} again")

    def _check(self) -> None:
        for check in self._guards:
            check()

    def _retry_s(self) -> float:
        return min(what.retry_s for what in self._on_loss) if self._reopen and self._comes_back else 0.0

    def _stopping(self) -> bool:
        return any(what.stopping() for what in list(self._on_loss))

    def _wait_for_board(self, greet: Callable[[], None], reason: LinkError) -> None:
        limit_s = self.clock() + self._retry_s()
        while not self._found_again(greet):
            self._check()
            if self._stopping():
                limit_s = min(limit_s, self.clock() + STOPPING_RECONNECT_S)
            if self.clock() >= limit_s:
                raise self._gone(reason)
            self._sleep(REOPEN_INTERVAL_S)

    def _gone(self, reason: LinkError) -> LinkError:
        if not self._stopping():
            return reason
        return LinkError(
            f"{reason.problem}; no stop could be sent: a motion may still be running",
            "see 'armtempo status' once it is back",
        )

    def _found_again(self, greet: Callable[[], None]) -> bool:
        """Open the port and greet the board; False if that fails."""
        try:
            self.open_again()
            greet()
            return True
        except OtherBoardError:
            raise
        except ArmtempoError:
            self.transport.close()
            return False

    def _next_frame(self) -> wire.Frame | None:
        frame: wire.Frame | None = self._parser.next()
        return frame

    def _keep_event(self, frame: wire.Frame) -> None:
        try:
            event = board_messages.event(frame.number, frame.payload)
        except wire.WireError:
            return  # a reply to an older command, or a message of a newer protocol
        self.events.append(event)
        for listener in self._listeners:
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
