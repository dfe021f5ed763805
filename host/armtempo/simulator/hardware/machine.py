"""The part of the STM32 port's ``machine`` that the board program uses."""

import machine_state
from chip import memory
from chip.processor import CALL_TICKS, TICKS_PER_MS
from firmware.pin_api import Pin  # noqa: F401

PWRON_RESET, HARD_RESET, WDT_RESET, DEEPSLEEP_RESET, SOFT_RESET = 1, 2, 3, 4, 0
_RLR = 2  # word of IWDG


class _Memory:
    """``mem32``, ``mem16`` and ``mem8``. Reads beyond 31 bits are signed, as on the chip."""

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
        if words is memory.sectors:
            machine_state.flash.sectors.program(at, value)
            return
        shift = 8 * (where & 3)
        kept = words[at] & ~(self._mask << shift)
        words[at] = kept | (value & self._mask) << shift
        machine_state.board.wrote()


mem8 = _Memory(1)
mem16 = _Memory(2)
mem32 = _Memory(4)


def idle():
    """Sleep until the next interrupt; SysTick's comes every millisecond."""
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
    """Disable interrupts; returns the previous state for ``enable_irq``."""
    before = not machine_state.board.masked
    machine_state.board.masked = True
    return before


def enable_irq(state=True):
    """Restore the state of interrupts."""
    machine_state.board.masked = not state
    if state:
        machine_state.board.spend(CALL_TICKS)


def soft_reset():
    """Restart MicroPython; the hardware keeps its registers."""
    raise machine_state.Reset(SOFT_RESET)


def reset():
    raise machine_state.Reset(HARD_RESET)


class WDT:
    """The independent watchdog: resets the board unless ``feed`` is called every ``timeout`` ms; cannot be stopped."""

    def __init__(self, id=0, timeout=5000):
        if not 1 <= timeout <= 32000:
            raise ValueError("WDT timeout must be from 1 to 32000 ms")
        machine_state.board.watchdog_ticks = timeout * TICKS_PER_MS
        memory.poke(memory.index("IWDG") + _RLR, timeout // 8)
        machine_state.board.watchdog_deadline = machine_state.board.now + machine_state.board.watchdog_ticks
        _schedule_check()

    def feed(self):
        """Start the time over."""
        board = machine_state.board
        board.watchdog_deadline = board.now + board.watchdog_ticks
        board.call()


def _schedule_check():
    machine_state.board.at(machine_state.board.watchdog_deadline, _check_watchdog)


def _check_watchdog():
    if machine_state.board.now >= machine_state.board.watchdog_deadline:
        raise machine_state.Reset(WDT_RESET)
    _schedule_check()
