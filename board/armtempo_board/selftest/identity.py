"""What the board is: firmware, clocks, flash, heap."""

import time

import micropython
import stm
from machine import mem32
from micropython import const

from armtempo_board.selftest.common import cost, count_cycles, cycles, feed, free, largest

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

_FLASH_FILE = "/flash/selftest.tmp"
_BLOCK = 4096
_CNT = const(9)  # word of the counter in a timer
_LONGEST = const(1)  # of the gaps
_FRAGMENT = const(1)  # of statvfs
_FREE_BLOCKS = const(3)
_NUMBERS = const(3)  # of a version


def clocks() -> "dict[str, int]":
    """Cycles, ticks of TIM2 and microseconds of SysTick in about 50 ms. TIM2 has no interrupt, DMA or output here."""
    rcc = stm.RCC + stm.RCC_APB1ENR
    mem32[rcc] = mem32[rcc] | 1
    for register in (stm.TIM_CR1, stm.TIM_DIER, stm.TIM_CCER, stm.TIM_SMCR, stm.TIM_PSC):
        mem32[stm.TIM2 + register] = 0
    mem32[stm.TIM2 + stm.TIM_ARR] = 0xFFFFFFFF
    mem32[stm.TIM2 + stm.TIM_EGR] = 1
    mem32[stm.TIM2 + stm.TIM_CR1] = 1
    at = stm.TIM2 + stm.TIM_CNT
    first_cycle, first_tick, first_us = cycles(), mem32[at], time.ticks_us()
    time.sleep_ms(50)
    last_cycle, last_tick, last_us = cycles(), mem32[at], time.ticks_us()
    mem32[stm.TIM2 + stm.TIM_CR1] = 0
    return {
        "cycles": (last_cycle - first_cycle) & 0xFFFFFFFF,
        "tim2": (last_tick - first_tick) & 0xFFFFFFFF,
        "us": time.ticks_diff(last_us, first_us),
    }


@micropython.viper
def read_often(words: ptr32, times: int) -> object:
    """Read a word again and again."""
    for _ in range(times):
        words[0]


def reading(words: "Any") -> int:
    """Cycles in which a word is read 1000 times."""
    return cost(read_often, words, 1100) - cost(read_often, words, 100)


def backup_access() -> "float | None":
    """Cycles by which reading a word of the backup SRAM takes longer than one of the heap."""
    from array import array

    from armtempo_board.hardware import backup_sram

    found = backup_sram.find()
    return (reading(found) - reading(array("i", [0]))) / 1000 if found else None


@micropython.viper
def note_gap(gaps: ptr32, timer: ptr32) -> object:
    """An interrupt: keep the longest time between two, in ticks. TIM2 counts."""
    now = timer[_CNT]
    passed = (now - gaps[0]) & 0x3FFFFFFF
    gaps[0] = now
    if passed > gaps[_LONGEST]:
        gaps[_LONGEST] = passed


def flash() -> "dict[str, Any] | None":
    """``write_file``, with the longest time in which no interrupt came (one is due every 0.5 ms), in microseconds."""
    from array import array

    import pyb

    gaps = array("i", [0, 0])
    at = stm.TIM2
    mem32[at + stm.TIM_CR1] = 1
    watch = pyb.Timer(7, freq=2000, callback=lambda _: note_gap(gaps, at))  # type: ignore[arg-type]
    try:
        time.sleep_ms(2)
        gaps[_LONGEST] = 0
        found = write_file()
        time.sleep_ms(2)
    finally:
        watch.deinit()
        mem32[at + stm.TIM_CR1] = 0
    if found:
        found["stall_us"] = gaps[_LONGEST] // 84
    return found


def write_file() -> "dict[str, Any] | None":
    """Milliseconds to write and read a file of 4 KB, None if there is no space; nothing is left of it."""
    import os

    space = os.statvfs("/flash")
    if space[_FREE_BLOCKS] * space[_FRAGMENT] < 4 * _BLOCK:
        return None
    data = bytes(range(256)) * (_BLOCK // 256)
    begin = time.ticks_ms()
    try:
        with open(_FLASH_FILE, "wb") as file:
            file.write(data)
        if hasattr(os, "sync"):
            os.sync()
        written = time.ticks_ms()
        with open(_FLASH_FILE, "rb") as file:
            same = file.read() == data
        end = time.ticks_ms()
    finally:
        os.remove(_FLASH_FILE)
    return {
        "write_ms": time.ticks_diff(written, begin),
        "read_ms": time.ticks_diff(end, written),
        "same": same,
    }


def measure() -> "dict[str, Any]":
    """The figures of this board."""
    import os
    import sys
    from binascii import hexlify

    import machine

    feed()
    count_cycles()
    _, _, _, _, name = os.uname()
    return {
        "machine": name,
        "version": ".".join([str(part) for part in sys.implementation.version[:_NUMBERS]]),
        "unique_id": hexlify(machine.unique_id()).decode(),
        "freq": list(machine.freq()),  # type: ignore[call-overload]
        "acr": mem32[stm.FLASH + stm.FLASH_ACR],
        "clocks": clocks(),
        "heap": free(),
        "largest": largest(),
        "flash": flash(),
        "backup_cycles": backup_access(),
    }
