"""Stands around the program in an emulated board, and stamps each pass of its loop (see tests/benchmark/loop_board.py).

TIM2 counts instructions there, scaled to ticks. It stands while something happens here, so only the program's work
takes time. DMA1 is memory: its streams catch up with the clock whenever the program looks at one.
"""

import gc
import os
import sys
import time
from array import array
from binascii import hexlify

import machine
import micropython
import pyb
import stm
import uctypes
from machine import mem32
from micropython import const

_SYSTICK_LOAD = const(0xE000E014)
_LOOKS = const(25)  # of the emulated board at the clock, in a millisecond
_PSC = const(0x28)
_EVERY_MS = const(50)  # a command that often while something moves, if the settings do not say so
_BEFORE, _BEHIND = const(20), const(40)  # turns between two commands, and at the end
_LOGGED = const(100)
_BACKUP_SRAM = const(0x2002F000)  # memory of the emulator's that the chip has not, for what it has not
_EDGES = const(0x2002C800)  # there too: how many edges, and of each the compare register and its time
_MOST_EDGES = const(1200)

dma = array("I", bytes(4 * 64))
unmoved = array("I", bytes(4 * 24))  # the encoders' timers
# 0: the clock; 1: entries of the log; 2: the turn's begin; 3, 4: bytes allocated since the last collection, and
# where the firmware keeps them; 5: whether the clock stands; 6: starts of the counters; from 8 on the log: what, and
# when
state = array("I", bytes(4 * (8 + 2 * _LOGGED)))
interrupts = []
feeds = []
programs = []  # functions of the program whose place is taken
here = {}


class Beyond:
    """A module, and what the chip's has besides, or instead."""

    def __init__(self, module, **names):
        self._module = module
        self._names = names

    def __getattr__(self, name):
        return self._names[name] if name in self._names else getattr(self._module, name)


class Timer:
    """Takes the hooks of the compare interrupt, and of the one that fills the rings."""

    OC_TIMING = pyb.Timer.OC_TIMING

    def __init__(self, number, callback=None, **settings):
        if callback:
            feeds.append(callback)
            mem32[here["feed_ticks"]] = (settings["period"] + 1) * (settings["prescaler"] + 1)

    def channel(self, number, mode, callback):
        """Keep it."""
        interrupts.append(callback)


@micropython.viper
def pause():
    """Let the clock stand."""
    timer2 = ptr32(1 << 30)
    words = ptr32(state)
    words[5] = 1
    words[0] = timer2[9]
    words[3] = ptr32(words[4])[0]


@micropython.viper
def resume(spent: int):
    """Let it continue, that many ticks later."""
    words = ptr32(state)
    ptr32(words[4])[0] = words[3]
    timer2 = ptr32(1 << 30)
    timer5 = ptr32((1 << 30) + 0xC00)
    now = words[0] + spent
    timer5[9] = now
    timer2[9] = now
    words[5] = 0


@micropython.viper
def log(what: int):
    """What happens at this moment."""
    words = ptr32(state)
    if words[1] < _LOGGED:
        at = 8 + 2 * words[1]
        words[at] = what
        words[at + 1] = words[0]
        words[1] += 1


@micropython.viper
def catch_up(stream: ptr32) -> int:
    """Let a stream hand on what has matched until now; the words that are left in this round."""
    now = ptr32(state)[0]
    left = stream[1] & 0xFFFF
    if stream[0] & 1:
        entries = stream[4]
        if entries == 0:
            entries = left
            stream[4] = left
        place = (stream[2] & 0x3FF) >> 2
        timer = ptr32(stream[2] - (place << 2))
        ring = ptr32(stream[3])
        if timer[3] & (1 << (place - 4)):
            due = timer[place]
            edges = ptr32(_EDGES)
            while now - due >= 0:
                count = edges[0]
                if count < _MOST_EDGES:
                    edges[0] = count + 1
                    edges[2 * count + 1] = stream[2]
                    edges[2 * count + 2] = due
                due = ring[entries - left]
                left -= 1
                if left == 0:
                    left = entries
            timer[place] = due
            stream[1] = left
    return left


@micropython.viper
def all_catch_up():
    """Let all streams."""
    at = 16
    for _ in range(8):
        catch_up(int(ptr32(dma)) + at)
        at += 24


@micropython.viper
def interrupt():
    """The compare interrupt."""
    words = ptr32(state)
    if words[5] == 0:
        pause()
        all_catch_up()
        resume(0)
        interrupts[0](None)


@micropython.viper
def feed() -> int:
    """The interrupt that fills the rings; 0 where the clock stands."""
    words = ptr32(state)
    if words[5]:
        return 0
    pause()
    all_catch_up()
    log(1 << 16)
    resume(0)
    feeds[0](None)
    pause()
    log(3 << 16)
    resume(0)
    return 1


@micropython.viper
def matches(words: ptr32, streams: ptr32) -> int:
    """In the place of the program's, whose streams stand behind the clock."""
    pause()
    all_catch_up()
    resume(0)
    return int(programs[0](int(words), int(streams)))


@micropython.viper
def enter(block: ptr32, angle: ptr32, angle_local: ptr32, time_local: ptr32):
    """A cell is taken up."""
    pause()
    log(2 << 16)
    resume(0)
    programs[1](int(block), int(angle), int(angle_local), int(time_local))


@micropython.viper
def begin_turn():
    """The turn begins now; nothing is logged."""
    words = ptr32(state)
    words[1] = 0
    words[2] = words[0]


@micropython.viper
def in_turn(at: int) -> int:
    """Ticks from the begin of the turn to a time."""
    words = ptr32(state)
    return (words[at] - words[2]) & 0x1FFFFFFF


@micropython.viper
def moving() -> int:
    """Whether the counters run."""
    return ptr32(1 << 30)[0] & 1


@micropython.viper
def wait(ticks: int):
    """Let so many pass."""
    timer2 = ptr32(1 << 30)
    began = ptr32(state)[0]
    while timer2[9] - began < ticks:
        pass


class Port:
    """Hands over the frames of a file, each after its length in two bytes; tells of each turn."""

    RTS = CTS = 0

    def __init__(self):
        self._frames = []
        with open("/flash/frames", "rb") as file:
            head = file.read(2)
            while head:
                self._frames.append(file.read(head[0] + 256 * head[1]))
                head = file.read(2)
        self._session = len(self._frames) - here["session"]
        self._left = b""
        self._every_ms = here.get("every_ms", _EVERY_MS)
        self._turns = self._fed_ms = 0
        self._moves = self._fed = self._said = False

    def init(self, flow):
        """Flow control does not matter here."""

    def readinto(self, buffer, count):
        """The first of these calls in a turn begins it."""
        pause()
        count = self._hand(buffer, count)
        resume(0)
        return count

    def _hand(self, buffer, count):
        if not self._left:
            self._turn()
        part = self._left[:count]
        self._left = self._left[count:]
        buffer[: len(part)] = part
        return len(part)

    def write(self, buffer, start, count):
        """Tell the host that watches."""
        pause()
        self._said = True
        print("@ answer", hexlify(memoryview(buffer)[start : start + count]).decode())
        resume(0)
        return count

    def _turn(self):
        moves = moving()
        self._turns += 1
        if self._moves:
            self._tell()
            if not moves:
                self._turns = 0
                self._frames = []
        self._moves = moves
        self._fed = self._said = False
        if moves:
            if self._frames and time.ticks_diff(time.ticks_ms(), self._fed_ms) > self._every_ms:
                self._feed()
        elif self._frames and self._turns > _BEFORE:
            self._feed()
            if len(self._frames) == self._session:
                hold_clock()
        elif self._turns > _BEHIND:
            print("@ end")
            sys.exit()
        if self._turns & 7 == 0:
            gc.collect()  # what is left behind here must not be collected in the program's time
        begin_turn()

    def _feed(self):
        self._turns = 0
        self._fed = True
        self._fed_ms = time.ticks_ms()
        self._left = self._frames.pop(0)

    def _tell(self):
        print("@ turn", in_turn(0), int(self._fed), int(self._said), end="")
        for entry in range(state[1]):
            print("", state[8 + 2 * entry], in_turn(9 + 2 * entry), end="")
        print()


def tell_edges():
    """What the compare units did since the last time, for the host that watches."""
    count = mem32[_EDGES]
    if count:
        assert count < _MOST_EDGES
        print("@ edges", hexlify(uctypes.bytearray_at(_EDGES + 4, 8 * count)).decode())
        mem32[_EDGES] = 0
        gc.collect()  # as in ``_turn``


def hold_clock():
    """From here on the counters as good as stand, also when they are started: see ``start_clock``."""
    mem32[stm.TIM2 + _PSC] = mem32[stm.TIM5 + _PSC] = 0xFFFF


def start_clock(us):
    """In the place of the short wait after the start of the counters: from here on they run.

    The next start is as this one only where the settings say ``again``, which costs the program a little time.
    """
    mem32[stm.TIM2 + _PSC] = mem32[stm.TIM5 + _PSC] = here["prescaler"]
    state[6] += 1
    if not here.get("again"):
        here["engine"].time = time
    mem32[here["at_compare"]] = id(interrupt)
    mem32[here["at_feed"]] = id(feed)
    pause()
    resume(0)
    wait(84 * us)


def nothing(*arguments):
    """In the place of what does not matter here."""


class Chip:
    """The addresses that the program asks for while it moves are as quick to look up as those of the module."""

    def __init__(self, **names):
        for name in ("TIM2", "TIM5", "TIM6"):
            setattr(self, name, getattr(stm, name))
        for name in names:
            setattr(self, name, names[name])

    def __getattr__(self, name):
        return getattr(stm, name)


def replace(settings, port=Port):
    """Put the port, and what the emulator has not, into place."""
    here.update(settings)
    state[4] = mem32[here["allocated"]]
    mem32[_SYSTICK_LOAD] = here["millisecond"] // _LOOKS - 1
    mem32[here["looks_per_ms"]] = _LOOKS
    still = uctypes.addressof(unmoved)
    sys.modules["pyb"] = Beyond(pyb, USB_VCP=port, Timer=Timer)
    sys.modules["os"] = Beyond(os, dupterm=nothing, urandom=bytes)
    sys.modules["machine"] = Beyond(machine, unique_id=lambda: b"123456789012")
    sys.modules["stm"] = Chip(
        BKPSRAM=_BACKUP_SRAM, DMA1=uctypes.addressof(dma), TIM1=still, TIM3=still, TIM4=still, TIM8=still
    )
    sys.modules["time"] = Beyond(time, sleep_us=start_clock)


def hook():
    """Take the place of two of the program's functions; the settings say where they and the engine are."""
    here["engine"] = sys.modules[here["engine"]]
    for (module, name), function in ((here["matches"], matches), (here["set_interval"], enter)):
        own = getattr(sys.modules[module], name)
        programs.append(own)
        for place in (sys.modules[module], here["engine"]):  # the engine's may have imported it from there
            if getattr(place, name, None) is own:
                setattr(place, name, function)
