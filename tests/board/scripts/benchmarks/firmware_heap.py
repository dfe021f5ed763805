"""Stands in main.py of an emulated board for the start of the program: prints the heap after each stage.

The program is driven through its serial port. ``memory_use.py`` has that port too.
All is in this one small file, because it shares the chip's heap with the program.
"""

import gc
import os
import sys
import time
from binascii import hexlify

import machine
import pyb
import stm
from micropython import mem_info

FRAMES = "/flash/frames"
ROUNDS = "/flash/rounds"
TURNS = 20
"""Passes of the program's loop between two frames, and at the end."""
BACKUP_SRAM = 0x2002F000
"""Memory of the emulator's that the chip has not, in the place of the backup SRAM that the emulator has not."""
STARTS_US = 50
"""What the engine waits for after it has let the counters run."""
_STAGE = 0x8000  # in the place of a frame's length, with the length of a stage's name, which follows


class Beyond:
    """A module, and what the chip's has besides, or instead."""

    def __init__(self, module, **names):
        self._module = module
        self._names = names

    def __getattr__(self, name):
        return self._names[name] if name in self._names else getattr(self._module, name)


class Port:
    """Hands over the frames of a file, each after its length in two bytes, then ends the program.

    Between frames there may be names of stages, each after its length + _STAGE: the heap is reported there.
    """

    RTS = CTS = 0

    def __init__(self):
        self._frames = open(FRAMES, "rb")  # noqa: SIM115  until the end
        self._left = self._second = 0  # bytes left of a frame; where the second begins
        self._rounds = rounds()
        self._turns = 0
        self._stages = ["program", "hello"]

    def init(self, flow):
        """Flow control does not matter here."""

    def readinto(self, buffer, count):
        """The rest of a frame, or nothing for some turns."""
        if self._left == 0:
            self._turns += 1
            if self._turns < TURNS:
                return 0
            self._turns = 0
            self._next()
        got = self._frames.readinto(memoryview(buffer)[: min(count, self._left)])
        self._left -= got
        return got

    def _next(self):
        if self._stages:
            tell(self._stages.pop(0))
        head = self._frames.read(2)
        if not head and self._rounds > 1:
            self._rounds -= 1
            self._frames.seek(self._second)
            head = self._frames.read(2)
        if not head:
            tell("motion")
            tell("end")
            sys.exit()
        self._left = head[0] + 256 * head[1]
        if self._left >= _STAGE:
            tell(str(self._frames.read(self._left - _STAGE), "ascii"))
            self._next()
        elif not self._second:
            self._second = 2 + self._left

    def write(self, buffer, start, count):
        """Tell the host that watches."""
        print("@ answer", hexlify(memoryview(buffer)[start : start + count]).decode())
        return count


def rounds():
    """How often the host sends its frames, but for the first; 1 where nothing is said."""
    try:
        with open(ROUNDS) as file:
            return int(file.read())
    except OSError:
        return 1


def tell(name):
    """What is in use, and the largest free block."""
    gc.collect()
    print("@", name)
    mem_info()


def wait(us):
    """A motion starts: most is in use."""
    if us == STARTS_US:
        tell("started")
    time.sleep_us(us)


def nothing(*arguments):
    """In the place of what does not matter here."""


def replace():
    """Put the port, and what the emulator has not, into place."""
    sys.modules["pyb"] = Beyond(pyb, USB_VCP=Port)
    sys.modules["stm"] = Beyond(stm, BKPSRAM=BACKUP_SRAM)
    sys.modules["time"] = Beyond(time, sleep_us=wait)
    sys.modules["os"] = Beyond(os, dupterm=nothing, urandom=bytes)
    sys.modules["machine"] = Beyond(machine, unique_id=lambda: b"123456789012")
