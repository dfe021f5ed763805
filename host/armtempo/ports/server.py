"""The owner's end: answers requests of other programs, and publishes to subscribers.

Each connection has two threads, one that answers requests and one that writes, so a slow caller or a slow
request delays no other.
"""

from __future__ import annotations

import os
import queue
import socket
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from hmac import compare_digest
from threading import Lock, Thread

from armtempo.basics.errors import ArmtempoError, BoardError, LinkError, PortError
from armtempo.ports import claim as claims
from armtempo.ports.claim import VERSION, PortClaim
from armtempo.ports.messages import REQUESTS, Fields, LineReader, Message, check, is_id, to_line

Handler = Callable[[Message], Message]
"""Answers one request; an ArmtempoError is sent as an answer too."""

_BACKLOG = 128
BEAT_S = 0.5
"""Interval of the signs of life in the claim."""
_FLUSH_S = 0.5
"""Time for a caller to receive the last messages."""
_CHECK_S = 0.02
"""Shortest interval of checks whether another program has taken the port over."""
_QUEUE = 1000
"""Length of a slow reader's queue; further messages are dropped, and their number is reported."""


class Server:
    """Listens as the owner of a port until ``close``.

    ``handlers``: by request name; called only with fields that ``requests`` allows. Raises OSError if listening fails.
    """

    def __init__(
        self, claim: PortClaim, handlers: Mapping[str, Handler], requests: Mapping[str, Fields] = REQUESTS
    ) -> None:
        self._handlers = handlers
        self._requests = requests
        self._connections: set[_Connection] = set()
        self._lock = Lock()
        self._checked_s = 0.0
        self._taken_by: PortClaim | None = None
        self._socket = _listen(claim)
        self._socket.settimeout(BEAT_S)
        self.claim = claim if claim.address else claim._replace(address=str(self._socket.getsockname()[1]))
        self.claim.write()
        self._thread = Thread(target=self._accept, name="armtempo share", daemon=True)
        self._thread.start()

    def wanted(self, topic: str) -> bool:
        """Whether a topic has subscribers."""
        return any(topic in connection.topics for connection in self._all())

    def publish(self, topic: str, content: Message) -> None:
        """Send to all subscribers of a topic; never blocks."""
        listening = [connection for connection in self._all() if topic in connection.topics]
        if listening:
            line = to_line({"topic": topic, **content})
            for connection in listening:
                connection.send(line)

    def check(self) -> None:
        """Raise PortError if another program has taken the port over, because this one did not answer."""
        now_s = time.monotonic()
        if self._taken_by is None and now_s - self._checked_s >= _CHECK_S:
            self._checked_s = now_s
            self._taken_by = self.claim.taken_by()
        if self._taken_by is not None:  # reported each time, as callers may try to open the port again
            raise PortError(
                f"{self._taken_by.who} has taken {self.claim.port} over, as this program did not answer",
                "ask 'armtempo status' how the motion ended",
            )

    def close(self) -> None:
        """Give up the port and end all connections."""
        self.claim.remove()
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)  # wakes the accepting thread
        self._socket.close()
        for connection in self._all():
            connection.close()

    def _all(self) -> list[_Connection]:
        with self._lock:
            return list(self._connections)

    def _accept(self) -> None:
        beat_s = time.monotonic()
        while True:
            if time.monotonic() - beat_s >= BEAT_S:
                beat_s = time.monotonic()
                self.claim.beat()
            try:
                accepted, _ = self._socket.accept()
            except TimeoutError:
                continue
            except OSError:
                return
            connection = _Connection(accepted, self.claim, self._handlers, self._requests)
            with self._lock:
                self._connections.add(connection)
            Thread(target=self._serve, args=(connection,), name="armtempo reader", daemon=True).start()
            connection.start_writing()  # started later, so that a stop need not wait for a second thread

    def _serve(self, connection: _Connection) -> None:
        try:
            connection.serve()
        finally:
            with self._lock:
                self._connections.discard(connection)
            connection.close()


class _Connection:
    """One caller."""

    def __init__(
        self,
        accepted: socket.socket,
        claim: PortClaim,
        handlers: Mapping[str, Handler],
        requests: Mapping[str, Fields],
    ) -> None:
        self.topics: frozenset[str] = frozenset()
        self._socket = accepted
        self._claim = claim
        self._handlers = {"hello": self._hello, "subscribe": self._subscribe, **handlers}
        self._requests = requests
        self._known = not claim.token
        self._lines: queue.Queue[bytes | None] = queue.Queue(_QUEUE)
        self._dropped = 0
        self._writer = Thread(target=self._write, name="armtempo writer", daemon=True)
        self._starting = Lock()

    def start_writing(self) -> None:
        """Start the writing thread, unless it runs."""
        with self._starting:
            if self._writer.ident is None:
                self._writer.start()

    def serve(self) -> None:
        """Answer requests until the caller closes the connection or sends an invalid message."""
        reader = LineReader(self._socket)
        try:
            while (request := reader.read()) is not None:
                number = request.get("id")
                self.send(to_line({"id": number if is_id(number) else None, **self._answer(request)}))
        except LinkError as error:
            self.send(to_line({"id": None, **_failed(error)}))
        except OSError:
            return

    def send(self, line: bytes) -> None:
        """Put a line into the queue; drop it if the queue is full."""
        try:
            if self._dropped:
                self._lines.put_nowait(to_line({"topic": "lost", "messages": self._dropped}))
                self._dropped = 0
            self._lines.put_nowait(line)
        except queue.Full:
            self._dropped += 1

    def close(self) -> None:
        """End the connection after sending the queue, at most for _FLUSH_S."""
        self.start_writing()
        with suppress(queue.Full):
            self._lines.put_nowait(None)
        self._writer.join(_FLUSH_S)
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)
        self._socket.close()

    def _write(self) -> None:
        with suppress(OSError):
            while (line := self._lines.get()) is not None:
                self._socket.sendall(line)

    def _answer(self, request: Message) -> Message:
        if not is_id(request.get("id")):
            return _failed(LinkError("a request without an id", "give a whole number or a short text as id"))
        name = request.get("request")
        if not self._known and name != "hello":
            return _failed(LinkError("no hello yet", "say hello with the token first"))
        handler = self._handlers.get(name) if isinstance(name, str) else None
        if handler is None:
            return _failed(
                LinkError(f"no request {name!r:.40}", f"there are {', '.join(sorted(self._handlers))}")
            )
        try:
            check(request, self._requests[str(name)])
            return {"ok": True, **handler(request)}
        except ArmtempoError as error:
            return _failed(error)

    def _hello(self, request: Message) -> Message:
        if not compare_digest(request.get("token", "").encode(), self._claim.token.encode()):
            raise LinkError("wrong token", "take it from the file of the claim")
        self._known = True
        claim = self._claim
        return {"version": VERSION, "port": claim.port, "program": claim.program, "pid": claim.pid}

    def _subscribe(self, request: Message) -> Message:
        self.topics = frozenset(request["topics"])
        return {"topics": sorted(self.topics)}


def _listen(claim: PortClaim) -> socket.socket:
    if claims.LOCAL_SOCKETS:
        listening = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    else:
        listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        listening.bind(claim.address if claims.LOCAL_SOCKETS else ("127.0.0.1", 0))
        if claims.LOCAL_SOCKETS:
            os.chmod(claim.address, 0o600)
        listening.listen(_BACKLOG)
    except OSError:
        listening.close()
        raise
    return listening


def _failed(error: ArmtempoError) -> Message:
    code = {"code": error.code} if isinstance(error, BoardError) else {}
    return {"ok": False, "error": error.problem, "hint": error.hint, **code}
