"""Messages over a socket, one line of JSON each, UTF-8; the requests, their fields and the fields' types."""

from __future__ import annotations

import json
import socket
from collections.abc import Callable, Mapping
from typing import Any

from armtempo_shared.limits import FULL_OUTPUT
from armtempo_shared.messages import PERMILLE, RESUME, SLOWEST_PERMILLE

from armtempo.basics.errors import LinkError
from armtempo.basics.kinds import is_text, is_whole
from armtempo.ports.claim import VERSION
from armtempo.ports.line_socket import LONGEST_LINE, LineStream, LongLineError

Message = dict[str, Any]

TOPICS = ("sample", "status", "event", "traffic")
LONGEST_TEXT = 200
_SHOWN = 40


class LineReader:
    """Reads messages from a socket."""

    def __init__(self, connection: socket.socket) -> None:
        self._lines = LineStream(connection)

    def read(self) -> Message | None:
        """The next message; None at the end of the connection.

        Raises LinkError for an invalid message, TimeoutError after the socket's time-out, OSError if the
        connection breaks.
        """
        try:
            line = self._lines.read()
        except LongLineError:
            raise LinkError(
                f"a line of more than {LONGEST_LINE} bytes", "send messages of a line of JSON each"
            ) from None
        return None if line is None else parse(line)


def to_line(message: Message) -> bytes:
    """A message as bytes to send."""
    return json.dumps(message, allow_nan=False, separators=(",", ":")).encode() + b"\n"


def parse(line: bytes) -> Message:
    """The message in a line; raises LinkError if it is none."""
    try:
        found = json.loads(line, parse_constant=_no_number)  # the table of fields refuses what is not finite
    except (ValueError, RecursionError):
        found = None
    if not isinstance(found, dict):
        raise LinkError("not a message", "send a JSON object in one line")
    return found


def _no_number(word: str) -> None:
    raise ValueError(f"{word} is not JSON")


class Field:
    """One field of a request: ``words`` describe its values, ``fits`` tests one."""

    def __init__(self, words: str, fits: Callable[[Any], bool], needed: bool = True) -> None:
        self.words = words
        self.fits = fits
        self.needed = needed


Fields = Mapping[str, Field]


def _whole(least: int, most: int, *others: int, needed: bool = True) -> Field:
    words = f"a whole number from {least} to {most}" + "".join(f", or {other}" for other in others)
    return Field(words, lambda value: is_whole(value) and (least <= value <= most or value in others), needed)


def _is_short(value: Any) -> bool:
    return is_text(value) and len(value) <= LONGEST_TEXT


def _text() -> Field:
    return Field(f"text of at most {LONGEST_TEXT} printable characters", _is_short, needed=False)


REQUESTS: Mapping[str, Fields] = {
    "hello": {"version": _whole(VERSION, VERSION, needed=False), "token": _text()},
    "subscribe": {
        "topics": Field(
            f"a list of some of {', '.join(TOPICS)}",
            lambda value: (
                isinstance(value, list) and all(isinstance(one, str) and one in TOPICS for one in value)
            ),
        )
    },
    "status": {},
    "stop": {
        "now": Field("true or false", lambda value: isinstance(value, bool), needed=False),
        "by": _text(),
    },
    "speed": {"rate": _whole(SLOWEST_PERMILLE, PERMILLE, 0, RESUME)},
    "output": {"number": _whole(0, 255), "value": _whole(0, FULL_OUTPUT)},
    "inputs": {},
}


def is_id(value: object) -> bool:
    """Whether a value is allowed as the ``id`` of a request, which the answer repeats."""
    return is_whole(value) or _is_short(value)


def check(request: Message, fields: Fields) -> None:
    """Raise LinkError if the fields of a request do not fit the table."""
    name = request["request"]
    for field, wanted in fields.items():
        if field not in request:
            if wanted.needed:
                raise LinkError(f"{name}: {field} is missing", f"{field} is {wanted.words}")
        elif not wanted.fits(request[field]):
            raise LinkError(f"{name}: {field} is {request[field]!r:.{_SHOWN}}", f"it must be {wanted.words}")
    for field in request.keys() - fields.keys() - {"id", "request"}:
        there = f"it has {', '.join(fields)}" if fields else "it has none"
        raise LinkError(f"{name}: no field {field!r:.{_SHOWN}}", there)
