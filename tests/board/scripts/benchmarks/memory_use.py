"""How the heap of the board program grows: prints a name and the bytes in use at each stage.

The program runs from the image for the chip's last two sectors, which is mapped to their address; hardware is the
memory of ``bare``. Arguments: folder of the store, with an arm and a motion; a file with the frames that a host sends,
each behind its length in two bytes, the last one starting the motion; a file for what the program answers; bytes of
heap that the program finds; the image.
"""

import gc
import os
import sys

sys.path.insert(0, __file__.rsplit("/", 2)[0] + "/rigs/bare")

import struct

import ffi
import firmware_heap
import machine
import micropython
import pyb
import stm
import uctypes  # noqa: F401
from firmware_heap import Beyond, nothing

_START = 0
_MOST = 0
_SECTORS_AT, _SECTORS_BYTES = 0x080C0000, 0x40000
_STATIC = 0x10000000  # beyond 2**30 an id is a negative number: what is the interpreter's own, and lies there
_ALL, _PRIVATE_FIXED = 7, 0x12  # of mmap


def tell(name):
    """The bytes that are in use beyond what the stand-ins took."""
    gc.collect()
    if name == "end":
        ANSWERS.close()
        print("check", _MOST)
        print("code elsewhere", elsewhere())
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


def map_sectors(path):
    """Map the image to where the chip has its last two sectors."""
    with open(path, "rb") as file:
        mmap = ffi.open("libc.so.6").func("p", "mmap", "piiiii")
        assert mmap(_SECTORS_AT, _SECTORS_BYTES, _ALL, _PRIVATE_FIXED, file.fileno(), 0) == _SECTORS_AT


def functions(names):
    """Functions of a module, and of the classes in it."""
    for item in names.values():
        if id(item) < _STATIC:
            continue
        if type(item).__name__ == "type":
            yield from functions(item.__dict__)
        elif type(item).__name__ == "function":
            yield item


def elsewhere():
    """How many of the program's functions do not have their code in the sectors."""
    others = {unpack_from}
    for name, module in sys.modules.items():
        if not name.startswith("armtempo_") and hasattr(module, "__dict__"):
            others.update(functions(module.__dict__))
    found = 0
    for name, module in sys.modules.items():
        if name.startswith("armtempo_") and "." in name:
            for function in functions(module.__dict__):
                code = machine.mem32[id(function) + 12]
                found += function not in others and not _SECTORS_AT <= code < _SECTORS_AT + _SECTORS_BYTES
    return found


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
map_sectors(sys.argv[5])
gc.collect()
_START = gc.mem_alloc()

import armtempo_sectors  # noqa: E402, F401
from armtempo_board import load_program  # noqa: E402

program = load_program()
tell("modules")
try:
    program.main(sys.argv[1])
finally:
    ANSWERS.close()
