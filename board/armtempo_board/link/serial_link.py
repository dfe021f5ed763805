"""The board's end of the serial link: commands in, replies and events out. It never waits and never allocates.

If a host stops reading, ``out`` fills up. Then the reply waits in ``reply``, events wait at their sources,
and the main loop continues.
"""

import time
from struct import pack_into

from armtempo_shared.messages import LENGTH_AT, MAX_PAYLOAD, OVERHEAD, PAYLOAD_AT, SEQUENCE_AT, SYNC
from micropython import const

from armtempo_board.buffers import APPEND, CRC_TABLE, apply_crc, copy, equal, pack_offsets
from armtempo_board.link.frame_reader import FrameReader
from armtempo_board.prompt import PromptRequest

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

_OUT_SIZE = const(700)
_SEQUENCE_AND_NUMBER = const(2)  # bytes
_CRC = const(4)  # bytes


class SerialLink:
    """``poll`` reads commands; ``answer`` and ``event`` queue frames; ``flush`` writes them to the port."""

    def __init__(self, stream: "Any") -> None:
        self.stream = stream
        self.reader = FrameReader()
        self.reply = bytearray(MAX_PAYLOAD + OVERHEAD)
        self.out = bytearray(_OUT_SIZE)
        self.heard_ms: "Any" = 0  # time of the last valid frame
        self.escape = False  # Ctrl-C outside of any frame asks for the REPL
        self._begin = 0
        self._end = 0
        self._reply_size = 0  # of the last reply; 0: none yet
        self._reply_waits = False
        self._answered = bytearray(_SEQUENCE_AND_NUMBER + _CRC)  # of the command that it answers
        self._events = 0  # sequence number of the next
        self._prompt = PromptRequest()

    def poll(self) -> bool:
        """Whether a new command is in ``reader.data``."""
        now_ms = time.ticks_ms()
        reader = self.reader
        if not reader.poll(self.stream, now_ms):
            if self._prompt.comes(reader.outside, now_ms):
                self.escape = True
            return False
        self._prompt.clear()
        self.heard_ms = now_ms
        if self._repeated():
            self._reply_waits = True
            return False
        return not self._reply_waits  # an answer is still waiting for space: the host repeats its command

    def answer(self, number: int, size: int) -> None:
        """Send the reply whose payload of ``size`` bytes is in ``reply``."""
        self._reply_size = 0  # if this fails, the host's repeated command is executed
        self._remember()
        sequence = self.reader.data[SEQUENCE_AT]
        self._reply_size = self._finish(self.reply, 0, sequence, number, size)
        self._reply_waits = True

    def has_space(self, size: int) -> bool:
        """Whether an event with that many bytes of payload fits into ``out`` now; replies go first."""
        self._queue_reply()
        return not self._reply_waits and self._fits(size + OVERHEAD)

    def payload(self) -> int:
        """Index in ``out`` where the next event's payload is to be put."""
        return self._end + PAYLOAD_AT

    def event(self, number: int, size: int) -> None:
        """Send the event whose payload was put at ``payload()``; ask ``has_space()`` before."""
        self._end += self._finish(self.out, self._end, self._events, number, size)
        self._events = (self._events + 1) & 0xFF

    def flush(self) -> None:
        """Write as much to the port as it accepts."""
        self._queue_reply()
        if self._begin == self._end:
            return
        taken = self.stream.write(self.out, self._begin, self._end - self._begin)
        if taken:
            self._begin += taken
            if self._begin == self._end:
                self._begin = self._end = 0

    def forget(self) -> None:
        """For a new host: drop the frames for the old one."""
        self._begin = self._end = 0
        self._reply_waits = False

    def idle(self) -> bool:
        """Whether no frame is in progress in either direction."""
        return self._begin == self._end and not self._reply_waits and self.reader.empty()

    def _finish(self, buffer: bytearray, start: int, sequence: int, number: int, size: int) -> int:
        pack_into("<BHBB", buffer, start, SYNC, size, sequence, number)
        apply_crc(CRC_TABLE, buffer, pack_offsets(start + LENGTH_AT, start + PAYLOAD_AT + size), APPEND)
        return size + OVERHEAD

    def _fits(self, size: int) -> bool:
        if self._end + size > _OUT_SIZE and self._begin:
            copy(self.out, self.out, pack_offsets(0, self._begin), self._end - self._begin)
            self._end -= self._begin
            self._begin = 0
        return self._end + size <= _OUT_SIZE

    def _queue_reply(self) -> None:
        if self._reply_waits and self._fits(self._reply_size):
            copy(self.out, self.reply, pack_offsets(self._end, 0), self._reply_size)
            self._end += self._reply_size
            self._reply_waits = False

    def _remember(self) -> None:
        data = self.reader.data
        crc_at = PAYLOAD_AT + self.reader.length()
        copy(self._answered, data, pack_offsets(0, SEQUENCE_AT), _SEQUENCE_AND_NUMBER)
        copy(self._answered, data, pack_offsets(_SEQUENCE_AND_NUMBER, crc_at), _CRC)

    def _repeated(self) -> bool:
        """Whether the frame is the one that was answered last: same number, same content."""
        if not self._reply_size:
            return False
        data = self.reader.data
        crc_at = PAYLOAD_AT + self.reader.length()
        return bool(
            equal(self._answered, data, pack_offsets(0, SEQUENCE_AT), _SEQUENCE_AND_NUMBER)
            and equal(self._answered, data, pack_offsets(_SEQUENCE_AND_NUMBER, crc_at), _CRC)
        )
