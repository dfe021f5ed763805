"""Connects the program in an emulated board with a host, and prints the heap at each stage.

The host is on the third UART, which stands for USB; what happens here takes no time of the motion, as in
firmware_loop, whose stand-ins are used. Records go to a file system in memory that the chip has not.
"""

import gc
import time

import firmware_loop as loop
import pyb
import uctypes
import vfs
from micropython import const, mem_info

ROOT = "/ram/armtempo"
_BEYOND = const(
    0x20020000
)  # 60 KB of the emulator's that the chip has not, as _EDGES of firmware_loop and loop_board.c
_BLOCKS = const(100)  # the edges of firmware_loop begin where they end
_BLOCK = const(512)
_UART = const(3)
_RECEIVED = const(
    4096
)  # bytes: USB would hold the host back, which repeats a command of 1 KB five times a second
_STARTS = const(6)  # word of the state


class Blocks:
    """A block device in memory."""

    def __init__(self):
        self._data = uctypes.bytearray_at(_BEYOND, _BLOCK * _BLOCKS)

    def readblocks(self, number, buffer):
        """Read whole blocks."""
        buffer[:] = memoryview(self._data)[_BLOCK * number : _BLOCK * number + len(buffer)]

    def writeblocks(self, number, buffer):
        """Write whole blocks."""
        self._data[_BLOCK * number : _BLOCK * number + len(buffer)] = buffer

    def ioctl(self, request, argument):
        """How many blocks there are, and their size."""
        return {4: _BLOCKS, 5: _BLOCK}.get(request)


class Port:
    """The UART as the USB port; looks at the motion at each turn."""

    RTS = CTS = 0

    def __init__(self):
        self._stage = -1
        self._left_ms = self._longest_ms = 0
        self._starts = 0

    def init(self, flow):
        """Flow control does not matter here."""

    def readinto(self, buffer, count):
        """What has come."""
        loop.pause()
        self._look()
        uart = loop.here["uart"]
        got = uart.readinto(memoryview(buffer)[:count]) if uart.any() else 0
        self._left_ms = time.ticks_ms()
        loop.resume(0)
        return got or 0

    def write(self, buffer, start, count):
        """To the host."""
        loop.pause()
        loop.here["uart"].write(memoryview(buffer)[start : start + count])
        loop.resume(0)
        return count

    def _look(self):
        """Tell of the heap when the program has started, when a motion begins, and when it has ended."""
        moves = loop.moving()
        spent_ms = time.ticks_diff(time.ticks_ms(), self._left_ms)
        if loop.state[_STARTS] != self._starts:
            self._starts = loop.state[_STARTS]
            print("@ start", spent_ms)
        elif moves:
            self._longest_ms = max(self._longest_ms, spent_ms)
        if loop.here["edges"]:
            loop.tell_edges()
        if not moves:
            loop.hold_clock()
        if self._stage < 0:
            self._tell("started")
        elif moves and self._stage == 0:
            self._tell("running")
        elif not moves and self._stage == 1:
            print("@ longest", self._longest_ms)
            self._longest_ms = 0
            self._tell("ended")
            self._stage = 0

    def _tell(self, name):
        self._stage += 1
        gc.collect()
        print("@", name)
        mem_info()


def replace(settings):
    """Put the port, the file system, and what the emulator has not, into place."""
    blocks = Blocks()
    vfs.VfsFat.mkfs(blocks)
    vfs.mount(vfs.VfsFat(blocks), "/ram")
    loop.replace(dict(settings, again=True), Port)
    loop.here["uart"] = pyb.UART(_UART, 115200, timeout=0, rxbuf=_RECEIVED)
