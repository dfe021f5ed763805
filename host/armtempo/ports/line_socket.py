"""Lines over a socket, and requests as lines; imports so little that ``armtempo stop`` can use it at once.

One line holds one message in JSON, UTF-8 (``messages``).
"""

from __future__ import annotations

import _socket  # a part of CPython, as _json; their wrappers "socket" and "json" take several ms to import
import time
from _json import encode_basestring_ascii

TYPE_CHECKING = False  # as in "typing"
if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import Protocol

    class _Receiving(Protocol):
        def recv(self, size: int, /) -> bytes: ...


LONGEST_LINE = 1 << 20
_PIECE = 1 << 16
_RETRY_S = 0.02
"""Interval of attempts to connect to a program that has as many callers waiting as it can have."""


class LongLineError(ValueError):
    """A line is longer than LONGEST_LINE."""


class LineStream:
    """The lines that arrive on a socket."""

    def __init__(self, connection: _Receiving) -> None:
        self._connection = connection
        self._data = bytearray()

    def read(self) -> bytes | None:
        """The next line without its end; None at the end of the connection.

        Raises LongLineError, TimeoutError after the socket's time-out, OSError if the connection breaks.
        """
        while b"\n" not in self._data:
            if len(self._data) > LONGEST_LINE:
                raise LongLineError
            piece = self._connection.recv(_PIECE)
            if not piece:
                return None
            self._data += piece
        end = self._data.index(b"\n")
        line = bytes(self._data[:end])
        del self._data[: end + 1]
        return line


class LineSocket:
    """A caller's connection; close it at the end."""

    def __init__(self, address: str, limit_s: float) -> None:
        """``address``: path of a local socket, or a port of localhost.

        A program that many callers ask at once is waited for. Raises TimeoutError after ``limit_s``, OSError if
        nobody listens there.
        """
        until_s = time.monotonic() + limit_s
        while True:
            self._socket = _new(address)
            self._socket.settimeout(limit_s)
            try:
                self._socket.connect(("127.0.0.1", int(address)) if address.isdecimal() else address)
                break
            except BlockingIOError:  # a local socket says at once that too many callers wait
                self._socket.close()
                if time.monotonic() > until_s:
                    raise TimeoutError from None
                time.sleep(_RETRY_S)
            except OSError:
                self._socket.close()
                raise
        self._lines = LineStream(self._socket)

    def send(self, lines: bytes, timeout_s: float) -> None:
        """Send lines; raises TimeoutError, or OSError if the connection breaks."""
        self._socket.settimeout(timeout_s)
        self._socket.sendall(lines)

    def line(self, timeout_s: float | None) -> bytes | None:
        """The next line; as ``LineStream.read``."""
        self._socket.settimeout(timeout_s)
        return self._lines.read()

    def close(self) -> None:
        """Close the connection."""
        self._socket.close()


def request_line(number: int, request: str, fields: Mapping[str, object]) -> bytes:
    """A request as bytes to send; the values are whole numbers, truth values, texts, or lists of texts."""
    whole = {"id": number, "request": request, **fields}
    pairs = [f"{encode_basestring_ascii(name)}:{_json(value)}" for name, value in whole.items()]
    return ("{" + ",".join(pairs) + "}\n").encode()


def _json(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, list):
        return "[" + ",".join(map(_json, value)) + "]"
    return encode_basestring_ascii(value) if isinstance(value, str) else str(value)


def _new(address: str) -> _socket.socket:
    kind = _socket.AF_INET if address.isdecimal() else _socket.AF_UNIX
    return _socket.socket(kind, _socket.SOCK_STREAM)
