"""The independent watchdog (``machine.WDT``)."""

from simulator import memory, the
from simulator.board import TICKS_PER_MS, TICKS_PER_US
from simulator.reset import Reset

_WDT_RESET = 3
_RLR = 2


class WDT:
    """Resets the board unless ``feed`` is called every ``timeout`` ms; cannot be stopped.

    A program feeds it once a turn of its main loop, so ``feed`` also stands for the time that the turn's own
    work takes on the chip (option ``turn_us``).
    """

    def __init__(self, id=0, timeout=5000):
        if not 1 <= timeout <= 32000:
            raise ValueError("WDT timeout must be from 1 to 32000 ms")
        the.board.watchdog_ticks = timeout * TICKS_PER_MS
        memory.poke(memory.index("IWDG") + _RLR, timeout // 8)
        watched = the.board.watchdog_deadline is not None
        the.board.watchdog_deadline = the.board.now + the.board.watchdog_ticks
        if not watched:
            _watch()

    def feed(self):
        """Start the time over."""
        board = the.board
        board.watchdog_deadline = board.now + board.watchdog_ticks
        board.spend(the.options["turn_us"] * TICKS_PER_US)


def _watch():
    the.board.at(the.board.watchdog_deadline, _look)


def _look():
    if the.board.now >= the.board.watchdog_deadline:
        raise Reset(_WDT_RESET)
    _watch()
