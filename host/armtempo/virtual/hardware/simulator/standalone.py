"""A board without a launcher, for tests of hardware code: import this before the code under test.

``start(edge_log=…)`` powers a new board up and returns it; its time passes in simulated calls, or by
``board.spend(ticks)``. Options are those of ``options.py`` on the host.
"""

import sys

if sys.implementation.name != "micropython":
    import additions  # noqa: F401

from simulator import modules, setup, the

DEFAULTS = {
    "flash": ".",
    "program": [],
    "speed": 0,
    "edge_log": None,
    "unique_id": "000102030405060708090a0b",
    "dma_preload": True,
    "power_cut_at": 0,
    "turn_us": 1000,
    "arm": None,
    "faults": [],
}


def start(cause=1, serial=None, **options):
    """Power up; ``serial`` stands for the host's end of the line (default: a line that nobody uses)."""
    the.serial = serial or SilentLine()
    the.edges = None
    setup.power_up(dict(DEFAULTS, **options), cause)
    return the.board


class SilentLine:
    """A serial line without a host; ``received`` and ``sending`` are the port's buffers."""

    def __init__(self):
        self.ended = False
        self.reset()

    def reset(self):
        """The board was reset."""
        self.received = bytearray()
        self.sending = bytearray()
        self.rts = self.cts = False
        self.attached = True
        self.interrupt_char = 3

    def wait(self, ms):
        """Nothing will come."""
        return False

    def pump(self):
        """Nobody is there."""

    def put(self, data):
        """Keep what is sent."""
        self.sending.extend(data)
        return len(data)

    def take(self, count):
        """Up to so many received bytes."""
        data = bytes(self.received[:count])
        self.received = self.received[count:]
        return data


modules.replace()
