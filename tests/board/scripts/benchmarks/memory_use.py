"""How the heap of the board program grows: prints a name and the bytes in use at each stage.

The program is driven through its serial port, so it may be the compact one. Hardware is the memory of ``bare``.
Arguments: folder of the store, with an arm and a motion; a file with the frames that a host sends, each behind
its length in two bytes, the last one starting the motion; a file for what the program answers; bytes of heap that
the program finds.
"""

import builtins
import gc
import os
import sys

sys.path.insert(0, __file__.rsplit("/", 2)[0] + "/rigs/bare")

import struct

import firmware_heap
import machine
import micropython
import pyb
import stm
import uctypes  # noqa: F401
from firmware_heap import Beyond, nothing

_START = 0
_MOST = 0


def tell(name):
    """The bytes that are in use beyond what the stand-ins took."""
    gc.collect()
    if name == "end":
        ANSWERS.close()
    else:
        print(name, gc.mem_alloc() - _START)


class Time:
    """In the place of the module: where the program waits, the counters run."""

    def ticks_ms(self):
        """Time stands still."""
        return 0

    def ticks_diff(self, late, early):
        """Small numbers only."""
        return late - early

    def sleep_us(self, wait_us):
        """Move the counters of both timers."""
        for name in ("TIM2", "TIM5"):
            stm.BLOCKS[name][9] = stm.BLOCKS[name][9] + 84 * wait_us & 0xFFFFFFFF


class Pins:
    """In the place of the class: the pins of the firmware are constants and take no heap."""

    IN, OUT_PP, AF_PP, PULL_NONE, PULL_UP, PULL_DOWN = range(6)

    def __call__(self, *arguments, **how):
        """Any pin."""
        return self

    def value(self, level=None):
        """Low."""
        return 0

    def init(self, mode, pull=0, value=0):
        """Nothing to set."""


def free():
    """What is left of the heap that the program finds."""
    return int(sys.argv[4]) - (gc.mem_alloc() - _START)


class Port(firmware_heap.Port):
    """Writes what the program answers to a file."""

    def write(self, buffer, start, count):
        """All goes."""
        return ANSWERS.write(memoryview(buffer)[start : start + count])


def unpack_from(*arguments):
    """As in ``struct``; the check of a motion calls it while it has all that it needs."""
    global _MOST
    gc.collect()
    _MOST = max(_MOST, gc.mem_alloc() - _START)
    return struct.unpack_from(*arguments)


def watch(name, *arguments):
    """As the built-in ``__import__``; what comes after the check tells of it."""
    if name == "armtempo_board.endpoints":
        print("check", _MOST)
    return IMPORT(name, *arguments)


machine.unique_id = lambda: b"123456789012"
machine.idle = gc.collect
machine.reset_cause = lambda: 0
machine.WDT_RESET = 1
machine.WDT = lambda timeout: WATCHDOG
WATCHDOG = pyb.Pin("watchdog")
pyb.Pin.feed = nothing
pyb.LED = pyb.Pin = Pins()
pyb.USB_VCP = Port
sys.modules["time"] = Time()
sys.modules["struct"] = Beyond(struct, unpack_from=unpack_from)
sys.modules["gc"] = Beyond(gc, mem_free=free)
sys.modules["os"] = Beyond(os, dupterm=nothing)
sys.modules["micropython"] = Beyond(micropython, alloc_emergency_exception_buf=nothing, kbd_intr=nothing)
firmware_heap.FRAMES = sys.argv[2]
firmware_heap.tell = tell
ANSWERS = open(sys.argv[3], "wb")  # noqa: SIM115  until the end
IMPORT = builtins.__import__
gc.collect()
_START = gc.mem_alloc()

from armtempo_board import program  # noqa: E402

tell("modules")
builtins.__import__ = watch
try:
    program.main(sys.argv[1])
finally:
    builtins.__import__ = IMPORT
    ANSWERS.close()
