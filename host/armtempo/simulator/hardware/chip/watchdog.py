"""The independent watchdog (``machine.WDT``)."""

import machine_state

from chip import memory
from chip.processor import TICKS_PER_MS

_WDT_RESET = 3
_RLR = 2


class WDT:
    """Resets the board unless ``feed`` is called every ``timeout`` ms; cannot be stopped."""

    def __init__(self, id=0, timeout=5000):
        if not 1 <= timeout <= 32000:
            raise ValueError("WDT timeout must be from 1 to 32000 ms")
        machine_state.board.watchdog_ticks = timeout * TICKS_PER_MS
        memory.poke(memory.index("IWDG") + _RLR, timeout // 8)
        machine_state.board.watchdog_deadline = machine_state.board.now + machine_state.board.watchdog_ticks
        _watch()

    def feed(self):
        """Start the time over."""
        board = machine_state.board
        board.watchdog_deadline = board.now + board.watchdog_ticks
        board.call()


def _watch():
    machine_state.board.at(machine_state.board.watchdog_deadline, _look)


def _look():
    if machine_state.board.now >= machine_state.board.watchdog_deadline:
        raise machine_state.Reset(_WDT_RESET)
    _watch()
