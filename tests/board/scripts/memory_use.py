"""How the heap of the board program grows: prints a name and the bytes in use after each step.

Hardware is the memory of ``bare``. Arguments: folder of the store, with an arm and the motion "go", and where
its joints begin.
"""

import gc
import sys

sys.path.insert(0, __file__.rsplit("/", 1)[0] + "/bare")

import machine
import pyb
import stm  # noqa: F401
import uctypes  # noqa: F401

_START = 0


class Port:
    """Nobody is there."""

    def readinto(self, buffer, count):
        """Nothing comes."""
        return 0

    def write(self, buffer, start, count):
        """All goes."""
        return count


def tell(name):
    """The bytes that are in use beyond what the stand-ins took."""
    gc.collect()
    print(name, gc.mem_alloc() - _START)


machine.unique_id = lambda: b"123456789012"
machine.idle = gc.collect
machine.reset_cause = lambda: 0
machine.WDT_RESET = 1
pyb.LED = pyb.Pin
steps = [int(word) for word in sys.argv[2:]]
port = Port()
gc.collect()
_START = gc.mem_alloc()

from armtempo_board import program  # noqa: E402

tell("modules")
app = program._build(port, sys.argv[1])
tell("program")
app.home((1 << app.joints) - 1, steps)
app.engine.start = lambda homing: None  # nothing moves here: a motion is loaded, its rings are full
app.begin("go", 0)
tell("motion")
for _ in range(10):
    app.engine.service()
tell("turns")
assert app.fault() == 0
