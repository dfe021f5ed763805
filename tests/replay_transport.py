"""Playing a recorded traffic log back as if its board were there."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

from armtempo.basics.errors import LinkError
from armtempo.link.traffic import TO_BOARD, Chunk


class ReplayTransport:
    """A transport whose board says what a recorded board said.

    The host must say the same as in the recording (same session number, see Session); LinkError where
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
