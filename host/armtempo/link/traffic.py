"""The traffic log: every byte to and from the board, decoded.

A log is a text file with one tab-separated line per chunk of bytes::

    seconds since the start | ">" to the board, "<" from it | the bytes in hex | the frames decoded
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from armtempo_shared import wire
from armtempo_shared.messages import MAX_COMMAND

from armtempo.basics.atomic_file import os_reason
from armtempo.basics.errors import InputError
from armtempo.link.transport import Transport

HEADER = "# armtempo traffic 1"
TO_BOARD = ">"
FROM_BOARD = "<"


@dataclass(frozen=True)
class Chunk:
    """Consecutive bytes in one direction."""

    time_s: float
    direction: str
    data: bytes


Sink = Callable[[Chunk, list[str]], None]
"""Called with a chunk and the descriptions of the frames that it completes."""


class Decoder:
    """Decodes chunks of both directions; keeps incomplete frames for the next chunk."""

    def __init__(self) -> None:
        self._parsers = {TO_BOARD: wire.Parser(MAX_COMMAND), FROM_BOARD: wire.Parser()}

    def feed(self, direction: str, data: bytes) -> list[str]:
        """A description of each frame that this chunk completes, and a note on damaged bytes."""
        parser = self._parsers[direction]
        bad_before = parser.bad
        parser.feed(data)
        lines = []
        while (frame := parser.next()) is not None:
            lines.append(describe(direction, *frame))
        if parser.bad != bad_before:
            lines.append("(bytes outside of any frame)")
        return lines


def describe(direction: str, sequence: int, number: int, payload: bytes) -> str:
    """One frame as text: ``12 status``, ``12 ok status state=2 …``."""
    table = wire.COMMAND_BY_ID if direction == TO_BOARD else wire.EVENT_BY_ID
    entry = table.get(number)
    if entry is None:
        return f"{sequence} message {number:#04x}, unknown"
    try:
        return f"{sequence} {_describe_message(entry, payload)}"
    except wire.WireError:
        return f"{sequence} {entry[0]}, malformed"


def _describe_message(entry: tuple[Any, ...], payload: bytes) -> str:
    values, tail = wire.decode(entry, payload)
    if entry[0] == "ok" and values[0] in wire.ANSWER_BY_ID:
        return "ok " + _describe_message(wire.ANSWER_BY_ID[values[0]], tail)
    if entry[0] == "error" and values[0] in wire.COMMAND_BY_ID:
        name = wire.ERRORS.get(values[1], (f"code {values[1]}",))[0]
        return f"error {wire.COMMAND_BY_ID[values[0]][0]} {name} joint={values[2]} value={values[3]}"
    words = [f"{name}={value}" for name, value in zip(entry[3], values, strict=True)]
    if tail:
        words.append(repr(tail) if isinstance(tail, str) else f"+{len(tail)} bytes")
    return " ".join([entry[0], *words])


class LoggedTransport:
    """A transport that copies its traffic to a sink."""

    def __init__(self, inner: Transport, sink: Sink) -> None:
        self.name = inner.name
        self._inner = inner
        self._sink = sink
        self._decoder = Decoder()
        self._start = time.monotonic()

    def read(self, timeout_s: float) -> bytes:
        data = self._inner.read(timeout_s)
        if data:
            self._log(FROM_BOARD, data)
        return data

    def write(self, data: bytes) -> None:
        self._log(TO_BOARD, data)
        self._inner.write(data)

    def wake(self) -> None:
        self._inner.wake()

    def close(self) -> None:
        self._inner.close()

    def _log(self, direction: str, data: bytes) -> None:
        chunk = Chunk(time.monotonic() - self._start, direction, data)
        self._sink(chunk, self._decoder.feed(direction, data))


class LogFile:
    """A sink that writes a log; a context. Raises InputError if the file cannot be opened.

    Each line is flushed, so that a killed program leaves a readable log. If the disk is full, the log ends
    and the traffic continues; the context then raises InputError at its end, unless there is another error.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._failed: OSError | None = None
        try:
            self._file = path.open("w", encoding="utf-8")
        except OSError as error:
            raise InputError(
                f"{path}: the traffic log cannot be written: {error.strerror}",
                "choose another place",
            ) from error
        self._line(HEADER)

    def __call__(self, chunk: Chunk, words: list[str]) -> None:
        """Write one chunk."""
        self._line("\t".join((f"{chunk.time_s:.4f}", chunk.direction, chunk.data.hex(), "; ".join(words))))

    def _line(self, text: str) -> None:
        if self._failed is None:
            try:
                print(text, file=self._file, flush=True)
            except OSError as error:
                self._failed = error

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        with suppress(OSError):
            self._file.close()
        if self._failed is not None and value is None:
            raise InputError(
                f"{self._path}: the traffic log is cut short: {self._failed.strerror}",
                "free disk space, or leave --log-traffic out",
            )


def read_log(path: Path) -> Iterator[Chunk]:
    """The chunks of a log; raises InputError if it is none. An incomplete last line is skipped."""
    try:
        lines = path.read_text(encoding="utf-8").split("\n")
    except (OSError, UnicodeError) as error:
        raise InputError(
            f"{path}: the traffic log cannot be read: {os_reason(error)}",
            "check the path and its permissions",
        ) from error
    if lines[0] != HEADER:
        raise InputError(
            f"{path}: not a traffic log of armtempo (its first line should be {HEADER!r})",
            "give a file that --log-traffic wrote",
        )
    for number, line in enumerate(lines[1:-1], start=2):
        fields = line.split("\t")
        try:
            if len(fields) != 4 or fields[1] not in (TO_BOARD, FROM_BOARD):
                raise ValueError("four columns expected, the second > or <")
            time_s = float(fields[0])
            if not math.isfinite(time_s):
                raise ValueError(f"{fields[0]} is no time")
            yield Chunk(time_s, fields[1], bytes.fromhex(fields[2]))
        except ValueError as error:
            raise InputError(
                f"{path}, line {number}: not a line of a traffic log: {error}",
                "give a file as --log-traffic wrote it, not altered",
            ) from error
