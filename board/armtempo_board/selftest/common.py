"""What all parts use: cycles by DWT's counter (ARMv7-M C1.8, not in PM0214), the heap, ENABLE."""

import gc
import time

import stm
from machine import mem32

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

_DEMCR = 0xE000EDFC  # bit 24: DWT is on
_DWT_CTRL = 0xE0001000  # bit 0: it is enabled
_CYCCNT = 0xE0001004
_NOTED = 0x05E1F000
WATCHDOG_MS = 10000  # of a part that hangs


def count_cycles() -> None:
    """Enable the cycle counter."""
    mem32[_DEMCR] = mem32[_DEMCR] | 1 << 24
    mem32[_CYCCNT] = 0
    mem32[_DWT_CTRL] = mem32[_DWT_CTRL] | 1


def cycles() -> int:
    """Cycles of the processor, modulo 2**32."""
    return int(mem32[_CYCCNT] & 0xFFFFFFFF)


def cost(function: "Callable[..., Any]", *arguments: "Any", times: int = 5) -> int:
    """The fewest cycles of a call, including the reading of the counter."""
    fewest = 1 << 32
    for _ in range(times):
        before = cycles()
        function(*arguments)
        fewest = min(fewest, (cycles() - before) & 0xFFFFFFFF)
    return fewest


def feed() -> None:
    """Stop the timer that feeds the watchdog at the REPL, and feed it: a part that hangs ends in a reset."""
    import machine

    from armtempo_board.app import watchdog

    if watchdog._kept:
        watchdog._kept.deinit()
        watchdog._kept = None
    machine.WDT(timeout=WATCHDOG_MS).feed()


def note(number: int) -> int:
    """Store the running part (0: none) in the RTC's last backup register, which a reset keeps; returns the old one."""
    rcc, power = stm.RCC + stm.RCC_APB1ENR, stm.PWR + stm.PWR_CR
    mem32[rcc] = mem32[rcc] | 1 << 28  # PWREN
    mem32[power] = mem32[power] | 1 << 8  # DBP: the backup domain may be written
    time.sleep_us(10)
    at = stm.RTC + stm.RTC_BKP19R
    before = mem32[at]
    mem32[at] = _NOTED + number
    return int(before - _NOTED)


def enable() -> "tuple[bool, int, int]":
    """(is an output, output level, level of the pin) of ENABLE."""
    from armtempo_board.hardware import pins

    line = pins.line(pins.ENABLE)
    at = getattr(stm, "GPIO" + pins.port(pins.ENABLE))
    return (
        mem32[at + stm.GPIO_MODER] >> 2 * line & 3 == 1,
        mem32[at + stm.GPIO_ODR] >> line & 1,
        mem32[at + stm.GPIO_IDR] >> line & 1,
    )


def largest() -> int:
    """Bytes of the largest free block of the heap, to within 64."""
    gc.collect()
    low, high = 0, gc.mem_free() if hasattr(gc, "mem_free") else 1 << 20
    while high - low > 64:
        middle = (low + high) // 2
        try:
            bytearray(middle)
            low = middle
        except MemoryError:
            high = middle
        gc.collect()
    return low


def free() -> int:
    """Bytes of free heap."""
    gc.collect()
    return gc.mem_free() if hasattr(gc, "mem_free") else 0
