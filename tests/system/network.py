"""A network between a browser and the panel that stalls, delays, cuts and reorders what the browser sends."""

from __future__ import annotations

import asyncio
import re
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Self
from urllib.parse import urlsplit

_BYTES = 65536
_LONG, _LONGER = 126, 127
"""Lengths in a frame's second byte that say that the length follows in 2 or 8 bytes."""


class Network:
    """Carries what comes to a port of its own to the panel at ``address``, and back; ``with`` runs it."""

    def __init__(self, address: str) -> None:
        place = urlsplit(address)
        self._to = str(place.hostname), place.port or 0
        self._address = address
        self._ready = threading.Event()
        self._loop = asyncio.new_event_loop()
        self._open: asyncio.Event
        self._server: asyncio.Server
        self._writers: set[asyncio.StreamWriter] = set()
        self._port = 0
        self.refuses = False
        """Whether new connections are closed at once."""
        self.delay_s = 0.0
        """Of each frame of the browser."""
        self.last_first: Callable[[bytes], bool] | None = None
        """Which of the browser's frames waits until the one after it has passed."""
        self._thread = threading.Thread(target=self._run, daemon=True)

    @property
    def address(self) -> str:
        """The panel's page over this network."""
        return self._address.replace(f":{self._to[1]}/", f":{self._port}/")

    def __enter__(self) -> Self:
        self._thread.start()
        self._ready.wait()
        return self

    def __exit__(self, *_: object) -> None:
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()

    def stall(self, stalled: bool) -> None:
        """Carry nothing from the browser until it is mended; then what has come since."""
        self._loop.call_soon_threadsafe(self._open.clear if stalled else self._open.set)

    def cut(self) -> None:
        """Break every connection, and refuse new ones."""
        self.refuses = True
        self._loop.call_soon_threadsafe(lambda: [one.transport.abort() for one in self._writers])

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        self._loop.run_until_complete(self._begin())
        self._loop.run_forever()
        self._loop.run_until_complete(self._end())
        self._loop.close()

    async def _end(self) -> None:
        self._server.close()
        for one in self._writers:
            one.transport.abort()
        tasks = asyncio.all_tasks() - {asyncio.current_task()}
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def _begin(self) -> None:
        self._open = asyncio.Event()
        self._open.set()
        self._server = await asyncio.start_server(self._connected, "127.0.0.1", 0)
        self._port = self._server.sockets[0].getsockname()[1]
        self._ready.set()

    async def _connected(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if self.refuses:
            writer.transport.abort()
            return
        to_reader, to_writer = await asyncio.open_connection(*self._to)
        self._writers |= {writer, to_writer}
        with suppress(ConnectionError, asyncio.IncompleteReadError, asyncio.CancelledError):
            await asyncio.gather(_back(to_reader, writer), self._there(reader, to_writer))
        for one in (writer, to_writer):
            self._writers.discard(one)
            one.transport.abort()

    async def _there(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        while True:
            head = await reader.readuntil(b"\r\n\r\n")
            # The panel serves its own name; frames that are packed could not be read
            own = head.replace(str(self._port).encode(), str(self._to[1]).encode())
            writer.write(own.replace(b"Sec-WebSocket-Extensions", b"X-Extensions"))
            if b"upgrade: websocket" in head.lower():
                break
            length = re.search(rb"(?i)content-length: (\d+)", head)
            writer.write(await reader.readexactly(int(length[1]) if length else 0))
        held: list[bytes] = []
        while True:
            frame = await _frame(reader)
            await self._open.wait()
            if self.last_first is not None and not held and self.last_first(_text(frame)):
                held.append(frame)
                continue
            await asyncio.sleep(self.delay_s)
            writer.write(b"".join([frame, *held]))
            held.clear()


async def _back(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    while data := await reader.read(_BYTES):
        writer.write(data)
        await writer.drain()
    writer.close()


async def _frame(reader: asyncio.StreamReader) -> bytes:
    """A whole frame of a browser (RFC 6455, 5.2)."""
    head = await reader.readexactly(2)
    length, more = head[1] & 0x7F, b""
    if length in (_LONG, _LONGER):
        more = await reader.readexactly(2 if length == _LONG else 8)
        length = int.from_bytes(more, "big")
    return head + more + await reader.readexactly(4 + length)


def _text(frame: bytes) -> bytes:
    """What a frame of a browser says."""
    at = {_LONG: 4, _LONGER: 10}.get(frame[1] & 0x7F, 2)
    mask = frame[at : at + 4]
    return bytes(value ^ mask[place % 4] for place, value in enumerate(frame[at + 4 :]))
