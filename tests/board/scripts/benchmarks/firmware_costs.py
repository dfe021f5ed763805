"""Stands in main.py of an emulated board for the start of the program: counts instructions of what it calls.

The emulator gives each instruction a nanosecond, and its TIM2 a tick of one. QEMU's timers have no phase, so a cost is
right to the few instructions of reading one.
"""

import gc
import os
import sys
import time
from array import array
from binascii import crc32

import machine
import micropython
import pyb
import stm
from machine import mem32

ROOT = "/flash/armtempo"
BACKUP_SRAM = 0x2002F000
"""Memory of the emulator's that the chip has not, in the place of the backup SRAM that the emulator has not."""
RECORD_BYTES = 16384
GAP_TICKS = 3000
ROUNDS = 5

began = array("i", [0])


class Beyond:
    """A module, and what the chip's has besides, or instead."""

    def __init__(self, module, **names):
        self._module = module
        self._names = names

    def __getattr__(self, name):
        return self._names[name] if name in self._names else getattr(self._module, name)


class Port:
    """The first thing the program does with it in its loop is to read."""

    RTS = CTS = 0

    def init(self, flow):
        """Flow control does not matter here."""

    def readinto(self, buffer, count):
        """The program waits for a host now."""
        say("start", spent())
        costs()
        print("@ end")
        sys.exit()


@micropython.viper
def begin():
    """Count from here."""
    ptr32(began)[0] = ptr32(1 << 30)[9]


@micropython.viper
def spent() -> int:
    """Instructions since ``begin``."""
    return ptr32(1 << 30)[9] - ptr32(began)[0]


def say(name, cost):
    """A line for the host."""
    print("@ cost", name, cost)


def nothing(*arguments):
    """In the place of what does not matter here."""


def least(function, *arguments):
    """Instructions of a call, the least of some: an interrupt may come in one."""
    found = []
    for _ in range(ROUNDS):
        gc.collect()
        begin()
        function(*arguments)
        found.append(spent())
    return min(found)


def cost(name, function, *arguments):
    """Tell what a call takes, without the call itself."""
    say(name, least(function, *arguments) - least(nothing, *arguments))


def opened(path):
    """Open a file and close it."""
    open(path, "rb").close()


def read(path):
    """All of a file in pieces, as the check of a record reads it."""
    piece = memoryview(bytearray(256))
    with open(path, "rb") as file:
        while file.readinto(piece):
            pass


def costs():
    """Of what a start calls, once the program waits for a host."""
    from armtempo_board.storage import motion_file, store

    kept = store.Store(ROOT, False)
    for name in ("go", "large"):
        path = "%s/%s.atm" % (ROOT, name)
        size = os.stat(path)[6]
        say("bytes_" + name, size)
        cost("open_" + name, opened, path)
        cost("read_" + name, read, path)
        cost("check_" + name, motion_file.stated_crc, path, size)
        cost("motion_" + name, kept.motion, name)
    cost("kind", kept.kind, "go")
    cost("default", kept.default)
    cost("stat", os.stat, ROOT + "/go.atm")
    cost("statvfs", os.statvfs, ROOT)
    cost("listdir", os.listdir, ROOT)
    cost("store", store.Store, ROOT)
    cost("crc32", crc32, bytes(RECORD_BYTES // 4))
    cost("collect", gc.collect)
    start("jog")
    start("goto")


def start(name):
    """Of the parts of a start from memory, with the arm of the flash."""
    from armtempo_board import heap
    from armtempo_board.memory import Memory
    from armtempo_board.motion import endpoints, motion_check, rate_check
    from armtempo_board.stepgen.step_generator import StepGenerator
    from armtempo_board.storage.once import Once
    from armtempo_shared import armrecord, engine_memory

    heap.collect_often(16)  # as at a start
    _, rows, _ = armrecord.unpack(whole(ROOT + "/arm.ata"))[:3]
    record = whole("%s/%s.atm" % (ROOT, name))
    once = Once(len(record))
    once.put(0, len(record), record)
    say("bytes_" + name, len(record))
    cost("record_" + name, once.motion, None)
    motion = once.motion(None)
    generator = StepGenerator(Memory([engine_memory.GENERATOR_WORDS]))
    cost("check_" + name, motion_check.check, motion, rows, GAP_TICKS, generator.subintervals)
    cost("sum_" + name, rate_check.check_sum, motion, rows, 63, generator.subintervals)
    for is_time, at in (
        (True, motion.time_offset(0)),
        (False, motion.angle_offset(0)),
        (False, motion.angle_offset(1)),
    ):
        cost(
            "spline_" + name,
            motion_check._check_spline,
            motion,
            0,
            at,
            is_time,
            generator.subintervals.points,
        )
    cost("ends_" + name, endpoints.start_offset, motion, 0, 0)
    cost("duration_" + name, endpoints.duration_ticks, motion)
    for joint in range(motion.joints):
        at = endpoints.at_start(motion, joint) // 64
        cost("load_" + name, generator.load, motion, joint, at, 420, GAP_TICKS)
        generator.close()


def whole(path):
    """The bytes of a file."""
    with open(path, "rb") as file:
        return file.read()


def replace():
    """Put the port, and what the emulator has not, into place; count the start."""
    timer = stm.TIM2
    mem32[timer + stm.TIM_PSC] = 0
    mem32[timer + stm.TIM_ARR] = -1
    mem32[timer + stm.TIM_EGR] = 1
    mem32[timer + stm.TIM_CR1] = 1
    begin()
    before_ms = time.ticks_ms()
    time.sleep_ms(20)
    a_ms = spent() // time.ticks_diff(time.ticks_ms(), before_ms)
    say("boot", before_ms * a_ms)
    sys.modules["pyb"] = Beyond(pyb, USB_VCP=Port)
    sys.modules["stm"] = Beyond(stm, BKPSRAM=BACKUP_SRAM)
    sys.modules["os"] = Beyond(os, dupterm=nothing, urandom=bytes)
    sys.modules["machine"] = Beyond(machine, unique_id=lambda: b"123456789012")
    begin()
