"""The USB serial port: ``pyb.USB_VCP`` with the firmware's buffers, on this process's stdin and stdout.

Both are the master end of a pseudo terminal from the launcher. The buffers are the firmware's
(usbd_cdc_interface.c): 1024 bytes each way; further input is lost, unless RTS flow control stops the host.
"""

import select

import machine_state
from chip.processor import TICKS_PER_US

BUFFER = 1024
_CHUNK = 512
_POLLIN = 1


class SilentPort:
    """The port's buffers, with a host that neither sends nor reads.

    ``attached``: the REPL has the port, and ``interrupt_char`` interrupts the program.
    """

    ended = False

    def __init__(self):
        self.reset()

    def reset(self):
        """The board was reset: buffered bytes are lost."""
        self.silent = False
        self.received = bytearray()
        self.pieces = 0  # number of times that input arrived
        self.sending = bytearray()
        self.rts = self.cts = False
        self.attached = True
        self.interrupt_char = -1  # until the REPL runs something

    def wait(self, ms):
        """Wait in real time for input, at most so long; True if there is some."""
        return False

    def pump(self):
        """Move bytes between the buffers and the host."""

    def stuck(self):
        """Whether the host does not read what was sent to it."""
        return bool(self.sending) and not self.silent

    def put(self, data):
        """Queue bytes for the host; returns how many fit."""
        count = min(len(data), BUFFER - len(self.sending))
        self.sending.extend(memoryview(data)[:count])
        return count

    def take(self, count):
        """Up to ``count`` received bytes."""
        data = bytes(self.received[:count])
        self.received = self.received[count:]
        return data


class Serial(SilentPort):
    """The line to the host at the pseudo terminal."""

    def __init__(self):
        super().__init__()
        self._in = open(0, "rb", buffering=0)  # noqa: SIM115
        self._out = open(1, "wb", buffering=0)  # noqa: SIM115
        self._poll = select.poll()
        self._poll.register(self._in, _POLLIN)
        self._nothing = select.poll()
        self._chunk = memoryview(bytearray(_CHUNK))

    def wait(self, ms):
        """As ``SilentPort.wait``; input is ignored while ``silent``."""
        return bool((self._nothing if self.silent else self._poll).poll(ms))

    def pump(self):
        """Move bytes between the buffers and the host."""
        if self.silent:
            return
        if self.sending:
            written = self._out.write(self.sending)
            if written:
                self.sending = self.sending[written:]
        while not self.ended:
            space = BUFFER - 1 - len(self.received)
            if self.rts and space < 65:
                return
            piece = self._chunk[: min(space, _CHUNK)] if self.rts else self._chunk
            try:
                count = self._in.readinto(piece)
            except OSError:  # the other end of the pseudo terminal is closed
                count = 0
            if not count:
                self.ended = count == 0
                return
            self.pieces += 1
            self._take_in(bytes(piece[:count]), space)
            if count < len(piece):
                return

    def _take_in(self, data, space):
        if self.attached and self.interrupt_char >= 0:
            found = data.find(bytes((self.interrupt_char,)))
            if found >= 0:
                data = data[:found] + data[found + 1 :]
                machine_state.board.interrupted = True
        self.received.extend(data if self.rts else data[:space])


class USB_VCP:
    """``pyb.USB_VCP``."""

    RTS, CTS, IRQ_RX = 1, 2, 1

    def __init__(self, id=0):
        self._line = machine_state.serial

    def init(self, flow=-1):
        """Set flow control: RTS stops the host at a full buffer, CTS makes ``write`` write only what fits."""
        if flow >= 0:
            self._line.rts = bool(flow & self.RTS)
            self._line.cts = bool(flow & self.CTS)

    def setinterrupt(self, char):
        """Set the byte that interrupts the program while the REPL has the port; -1: none."""
        self._line.interrupt_char = char

    def isconnected(self):
        """Whether a host has opened the port."""
        machine_state.board.call()
        return not machine_state.settings.get("cable_out", False)

    def any(self):
        """Whether bytes wait."""
        machine_state.board.call()
        return bool(self._line.received)

    def recv(self, data, timeout=5000):
        """Receive into a buffer, or a number of bytes; the time-out is per byte, in ms."""
        wanted = data if isinstance(data, int) else len(data)
        waited = 0
        while len(self._line.received) < wanted and waited < timeout:
            before = len(self._line.received)
            machine_state.pace.idle()
            waited = waited + 1 if len(self._line.received) == before else 0
        machine_state.board.call()
        got = self._line.take(wanted)
        if isinstance(data, int):
            return got
        data[: len(got)] = got
        return len(got)

    def send(self, data, timeout=5000):
        """Send a buffer or one byte; returns the number of bytes sent. The time-out is per byte, in ms."""
        if isinstance(data, int):
            data = bytes((data,))
        sent = self._line.put(data)
        waited = 0
        while sent < len(data) and waited < timeout:
            machine_state.pace.idle()
            more = self._line.put(memoryview(data)[sent:])
            sent += more
            waited = 0 if more else waited + 1
        machine_state.board.call()
        return sent

    def read(self, size=-1):
        """The received bytes, up to ``size``; None if there are none.

        A program calls this once in each pass of its main loop, so an empty read also takes the time of the pass's
        own work on the chip (option ``turn_us``).
        """
        if not self._line.received:
            machine_state.board.spend(machine_state.options["turn_us"] * TICKS_PER_US)
            return None
        there = len(self._line.received)
        return self.recv(there if size < 0 else min(size, there), timeout=0)

    def readinto(self, buffer, size=None):
        """As ``read``, into a buffer; returns the number of bytes, or None."""
        got = self.read(len(buffer) if size is None else size)
        if got is None:
            return None
        buffer[: len(got)] = got
        return len(got)

    def write(self, data, start=0, size=None):
        """With CTS flow control: write what fits, None if nothing does. Without: wait, then drop the rest."""
        if size is not None:
            data = memoryview(data)[start : start + size]
        if self._line.cts:
            return self.send(data, timeout=0) or None
        self.send(data, timeout=500)
        return len(data)

    def close(self):
        """Nothing to do."""
