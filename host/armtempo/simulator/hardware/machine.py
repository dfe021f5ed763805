"""MicroPython's ``machine`` of the STM32 port, as far as the board program uses it."""

import machine_state
from chip import memory
from chip.processor import CALL_TICKS
from chip.watchdog import WDT  # noqa: F401
from firmware.pin_api import Pin  # noqa: F401

PWRON_RESET, HARD_RESET, WDT_RESET, DEEPSLEEP_RESET, SOFT_RESET = 1, 2, 3, 4, 0


class _Memory:
    """``mem32`` and its narrower siblings. Reads are signed beyond 31 bits, as on the chip."""

    def __init__(self, size):
        self._mask = (1 << 8 * size) - 1

    def __getitem__(self, where):
        machine_state.board.call()
        shift = 8 * (where & 3)
        words, at = memory.place(where)
        if at == machine_state.board.cycles.at and words is memory.words:
            machine_state.board.cycles.look()
        value = words[at] >> shift & self._mask
        return value - (1 << 32) if value >> 31 else value

    def __setitem__(self, where, value):
        words, at = memory.place(where)
        shift = 8 * (where & 3)
        kept = words[at] & ~(self._mask << shift)
        words[at] = kept | (value & self._mask) << shift
        machine_state.board.wrote()


mem8 = _Memory(1)
mem16 = _Memory(2)
mem32 = _Memory(4)


def idle():
    """Sleep until the next interrupt; SysTick comes every millisecond."""
    machine_state.pace.idle()


def freq():
    """(core, AHB, APB1, APB2) clocks in Hz."""
    return 168_000_000, 168_000_000, 42_000_000, 84_000_000


def unique_id():
    """Twelve bytes that differ between boards."""
    return machine_state.settings["unique_id"]


def reset_cause():
    """Why the program was started."""
    return machine_state.settings["reset_cause"]


def disable_irq():
    """Hold interrupts back; returns the state before for ``enable_irq``."""
    before = not machine_state.board.masked
    machine_state.board.masked = True
    return before


def enable_irq(state=True):
    """Let interrupts through again."""
    machine_state.board.masked = not state
    if state:
        machine_state.board.spend(CALL_TICKS)


def soft_reset():
    """Start MicroPython again; the hardware keeps its registers."""
    raise machine_state.Reset(SOFT_RESET)


def reset():
    """As the reset button."""
    raise machine_state.Reset(HARD_RESET)
