"""Writes every edge of a pin, with its time, to a file; the format is in ``armtempo.simulator.edgelog``."""

import struct
from array import array

from chip.flash import real_open

MAGIC = b"ATE1"
EDGES, COUNTER, INPUT, RESET, PULSES = 1, 2, 3, 4, 5
RECORD = "<BBBBIq"
_CHUNK = 8192


class EdgeLog:
    """Logs all pins of a board, also after resets."""

    def __init__(self, path):
        self._file = real_open(path, "wb")
        self._buffer = bytearray(MAGIC)

    def listen(self, board):
        """A board was powered up."""
        for port in board.pins.ports:
            for line in port.lines:
                line.sinks.append(self)
                line.pulse_sinks.append(self)
        board.observers.append(self)
        self._buffer.extend(struct.pack(RECORD, RESET, 0, 0, 0, 0, 0))

    def edges(self, line, before, count, times, origin):
        """A pin toggled."""
        if count == 1:
            self._record(EDGES, line, before, 1, origin + times[0])
            self._buffer.extend(b"\0\0\0\0")
        else:
            self._record(EDGES, line, before, count, origin)
            self._buffer.extend(bytes(array("I", times)))
        if len(self._buffer) > _CHUNK:
            self._write()

    def pulses(self, line, pulses, now):
        """The PWM on a pin changed."""
        high, period = pulses
        self._record(PULSES, line, 0, high, now)
        self._buffer.extend(struct.pack("<I", period))
        self._write()

    def counting(self, timer, now):
        """A timer started or stopped."""
        self._buffer.extend(struct.pack(RECORD, COUNTER, timer.number, timer.running, 0, timer.count(0), now))
        if not timer.running:
            self._write()

    def input_changed(self, line, level, now):
        """An input was changed from outside."""
        self._record(INPUT, line, 1 - level, 1, now)
        self._buffer.extend(b"\0\0\0\0")

    def _record(self, kind, line, before, count, base):
        pin = line.port.index * 16 + line.number
        self._buffer.extend(struct.pack(RECORD, kind, pin, before, 0, count, base))

    def _write(self):
        self._file.write(self._buffer)
        self._file.flush()
        self._buffer = bytearray()

    def flush(self):
        """Write the buffered edges."""
        if self._buffer:
            self._write()
