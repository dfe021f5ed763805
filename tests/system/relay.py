"""A cable between host and virtual board that can be bad, and be pulled."""

from __future__ import annotations

import os
import select
import threading
import tty
from collections import deque
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Self

from armtempo.basics.errors import LinkError
from armtempo.link.traffic import TO_BOARD, Chunk

Way = Callable[[bytes], tuple[bytes, float]]
"""Gets what is sent, gives what arrives (and a delay, not used here)."""
_LOOK_S = 0.02


class Relay:
    """Carries bytes between ``device``, a virtual board's port, and a port of its own at ``path``."""

    def __init__(self, device: str, path: Path, to_board: Way, from_board: Way) -> None:
        self.port = str(path)
        self._ways = (to_board, from_board)
        self._board = os.open(device, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(self._board)
        self._host = -1
        self._out = threading.Event()
        self._gone = threading.Event()
        self._lock = threading.Lock()
        self.plug()
        self._thread = threading.Thread(target=self._carry)
        self._thread.start()

    def plug(self) -> None:
        """Put the cable in: the port is there."""
        with self._lock:
            self._host, slave = os.openpty()
            tty.setraw(slave)
            os.symlink(os.ttyname(slave), self.port)
            self._slave = slave

    def unplug(self) -> None:
        """Pull the cable: the port is gone, for all that have it open as well."""
        with self._lock:
            os.unlink(self.port)
            os.close(self._slave)
            os.close(self._host)
            self._host = -1

    def _carry(self) -> None:
        while not self._gone.is_set():
            with self._lock:
                ends = [self._board] + [self._host] * (self._host >= 0)
                ready = select.select(ends, [], [], _LOOK_S)[0]
                for end in ready:
                    self._pass_on(end)

    def _pass_on(self, end: int) -> None:
        data = os.read(end, 4096)
        arrives, _ = self._ways[end == self._board](data)
        other = self._host if end == self._board else self._board
        while arrives and other >= 0:
            arrives = arrives[os.write(other, arrives) :]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *failure: object) -> None:
        self._gone.set()
        self._thread.join()
        if self._host >= 0:
            self.unplug()
        os.close(self._board)


class ReplayTransport:
    """A transport whose board says what a recorded board said.

    The host must say the same as in the recording (same session number, see Session); LinkError if
    it says something else or the recording is at its end.
    """

    name = "replay"

    def __init__(self, chunks: Iterable[Chunk]) -> None:
        self._chunks = deque(chunks)

    def read(self, timeout_s: float) -> bytes:
        """The recorded board's next bytes, if it spoke before the host's next word."""
        if self._chunks and self._chunks[0].direction != TO_BOARD:
            return self._chunks.popleft().data
        return b""

    def write(self, data: bytes) -> None:
        """Take the host's bytes as the next recorded ones; what the board said before is dropped unread."""
        while self._chunks and self._chunks[0].direction != TO_BOARD:
            self._chunks.popleft()
        expected = self._chunks.popleft().data if self._chunks else b""
        if data != expected:
            raise LinkError(
                f"replay: the recording has {expected.hex()!r} where the host says {data.hex()!r}"
            )

    def wake(self) -> None:
        """See Transport."""

    def close(self) -> None:
        """Nothing to free."""
