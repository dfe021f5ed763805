"""The watchdog: resets the chip if the main loop hangs.

The hardware cannot be stopped once started. So a timer feeds it after the program is left for the REPL, and,
by ``boot.py``, after a soft reset.
"""

import machine
import pyb
from micropython import const

_TIMEOUT_MS = const(8000)
_RELOAD = const(0x40003008)  # IWDG_RLR, RM0090 page 714
_UNTOUCHED = const(0xFFF)  # its value after a reset
_TIMER = const(7)  # used by nothing else
_FEEDS_HZ = const(1)

_kept = None


class Watchdog:
    """Starts with the loop, so that a program that fails earlier leaves a usable REPL."""

    def __init__(self) -> None:
        self._watchdog = machine.WDT(timeout=_TIMEOUT_MS)
        self.feed = self._watchdog.feed
        if _kept:
            _kept.deinit()

    def leave(self) -> None:
        """From now on, feed it from a timer interrupt."""
        keep_fed()


def has_reset() -> bool:
    """Whether it caused the last reset."""
    return machine.reset_cause() == machine.WDT_RESET


def running() -> bool:
    """Whether it was started since the last hard reset."""
    return bool(machine.mem32[_RELOAD] & _UNTOUCHED != _UNTOUCHED)


def keep_fed() -> None:
    """Feed it once a second from a timer interrupt, which allocates nothing."""
    global _kept
    feed = machine.WDT(timeout=_TIMEOUT_MS).feed
    _kept = pyb.Timer(_TIMER, freq=_FEEDS_HZ, callback=lambda timer: feed())
