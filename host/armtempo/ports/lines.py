"""Messages over a socket: one line of JSON each, UTF-8."""

from __future__ import annotations

import json
import socket
from typing import Any

from armtempo.basics.errors import LinkError

Message = dict[str, Any]

LONGEST_LINE = 1 << 20
_PIECE = 1 << 16


class LineReader:
    """Reads messages from a socket."""

    def __init__(self, connection: socket.socket) -> None:
        self._connection = connection
        self._data = bytearray()

    def read(self) -> Message | None:
        """The next message; None at the end of the connection.

        Raises LinkError for an invalid message, TimeoutError after the socket's time-out, OSError if the
        connection breaks.
        """
        while b"\n" not in self._data:
            if len(self._data) > LONGEST_LINE:
                raise LinkError(
                    f"a line of more than {LONGEST_LINE} bytes", "send messages of a line of JSON each"
                )
            piece = self._connection.recv(_PIECE)
            if not piece:
                return None
            self._data += piece
        end = self._data.index(b"\n")
        line = bytes(self._data[:end])
        del self._data[: end + 1]
        return _parse(line)


def to_line(message: Message) -> bytes:
    """A message as bytes to send."""
    return json.dumps(message, allow_nan=False, separators=(",", ":")).encode() + b"\n"


def _parse(line: bytes) -> Message:
    try:
        found = json.loads(line, parse_constant=_no_number)
    except (ValueError, RecursionError):
        found = None
    if not isinstance(found, dict):
        raise LinkError("not a message", "send a JSON object in one line")
    return found


def _no_number(word: str) -> None:
    raise ValueError(f"{word} is not JSON")
