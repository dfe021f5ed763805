"""The caller's end: find the program that has a port, ask it, subscribe to its messages."""

from __future__ import annotations

import itertools
import time
from collections.abc import Iterator
from enum import Enum
from typing import Any, Self

from armtempo.basics.errors import BoardError, LinkError, NoAnswerError, PortGivenUpError
from armtempo.ports.claim import VERSION, PortClaim
from armtempo.ports.line_socket import LineSocket, LongLineError, request_line
from armtempo.ports.messages import Message, parse

HUNG_S = 2.0
"""A program that has neither answered ``hello`` nor given a sign of life in its claim (``claim.beat``) for this
long counts as hanging; one that gives the sign is busy."""
_REMEMBERED_S = 5.0
"""Time for which a hanging program is not asked again."""
_END = "end that process, or let a command that needs the port take it over"
_hung: dict[str, float] = {}
"""Time at which a claim's program was last found to hang, by the claim's number."""


class Ownership(Enum):
    """The state of a program that has claimed a port."""

    ALIVE = "alive"
    """It answers, or is busy."""
    HUNG = "hung"
    """The process exists and does not answer."""
    DEAD = "dead"


def ownership(claim: PortClaim) -> Ownership:
    """Whether the program that has claimed a port is alive, hangs or is gone."""
    known = time.monotonic() < _hung.get(claim.number, 0.0) + _REMEMBERED_S
    if known and claim.silent_s() > HUNG_S:
        return Ownership.HUNG
    try:
        Caller(claim).close()
        return Ownership.ALIVE
    except NoAnswerError:
        return Ownership.HUNG if claim.silent_s() > HUNG_S else Ownership.ALIVE
    except LinkError:
        return Ownership.DEAD


def remember_hanging(number: str) -> None:
    """Note that the program of this claim hangs, so that the next call need not test it."""
    _hung[number] = time.monotonic()


class Caller:
    """A connection to the program that has a port; use it as a context, or ``close`` it.

    Raises NoAnswerError if that program hangs, LinkError if it has ended.
    """

    def __init__(self, claim: PortClaim) -> None:
        self.claim = claim
        self._numbers = itertools.count(1)
        self._published: list[Message] = []
        self._socket = _connect(claim)
        try:
            self.ask("hello", HUNG_S, version=VERSION, token=claim.token)
        except BaseException as error:
            if isinstance(error, NoAnswerError):
                remember_hanging(claim.number)
            self.close()
            raise

    def ask(self, request: str, timeout_s: float, **fields: Any) -> Message:
        """The answer to a request.

        Raises NoAnswerError after ``timeout_s``, BoardError or LinkError with the text of a refusal,
        LinkError if the program has ended.
        """
        number = next(self._numbers)
        limit_s = time.monotonic() + timeout_s
        self._send(request_line(number, request, fields))
        while True:
            message = self._receive(max(0.0, limit_s - time.monotonic()))
            if message is None:
                raise NoAnswerError(f"{self.claim.who} has {self.claim.port} and does not answer", _END)
            if "topic" in message:
                self._published.append(message)
            elif message.get("id") in (number, None):
                return _checked(message)

    def subscribe(self, *topics: str) -> None:
        """Subscribe to some of ``server.TOPICS``, for ``messages``."""
        self.ask("subscribe", HUNG_S, topics=list(topics))

    def messages(self, timeout_s: float | None = None) -> Iterator[Message]:
        """The subscribed messages, until the other program closes the port.

        The iteration also ends after ``timeout_s`` without a message.
        """
        while True:
            while self._published:
                yield self._published.pop(0)
            try:
                message = self._receive(timeout_s)
            except LinkError:
                return
            if message is None:
                return
            if "topic" in message:
                self._published.append(message)

    def close(self) -> None:
        """Close the connection."""
        self._socket.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *failure: object) -> None:
        self.close()

    def _send(self, line: bytes) -> None:
        try:
            self._socket.send(line, HUNG_S)
        except TimeoutError:
            raise NoAnswerError(
                f"{self.claim.who} has {self.claim.port} and accepts no requests", _END
            ) from None
        except OSError as error:
            raise self._gone() from error

    def _receive(self, timeout_s: float | None) -> Message | None:
        """The next message; None after ``timeout_s``."""
        try:
            line = self._socket.line(None if timeout_s is None else max(timeout_s, 1e-3))
        except TimeoutError:
            return None
        except (OSError, LongLineError) as error:
            raise self._gone() from error
        if line is None:
            raise self._gone()
        return parse(line)

    def _gone(self) -> LinkError:
        return PortGivenUpError(
            f"{self.claim.who} has closed {self.claim.port}", "try again: the port is free"
        )


def _connect(claim: PortClaim) -> LineSocket:
    try:
        return LineSocket(claim.address, HUNG_S)
    except TimeoutError:
        raise NoAnswerError(f"{claim.who} has {claim.port} and accepts no connection", _END) from None
    except OSError as error:
        raise LinkError(f"{claim.who} had {claim.port} and is gone", "try again: the port is free") from error


def _checked(message: Message) -> Message:
    if message.get("ok"):
        return message
    text = str(message.get("error", "refused without a reason"))
    hint = str(message.get("hint", ""))
    if isinstance(message.get("code"), int):
        raise BoardError(text, hint, message["code"])
    raise LinkError(text, hint)
