"""Stands in main.py of an emulated board for the start of the program: prints the heap after each stage."""

import gc

from micropython import mem_info


class Port:
    """Nobody is there."""

    def readinto(self, buffer, count):
        """Nothing comes."""
        return 0

    def write(self, buffer, start, count):
        """All goes."""
        return count


def tell(name):
    """What is in use, and the largest free block."""
    gc.collect()
    print("@", name)
    mem_info()


def run(program, before, steps):
    """Make the program, load the motion "go" that begins at ``steps``, let the main loop turn.

    ``before``: bytes that were in use before this module was imported.
    """
    from armtempo_board import app as module

    gc.collect()
    print("@ own", gc.mem_alloc() - before)
    tell("modules")
    module._board_id = lambda: b""  # the emulator has no unique id
    app = program._build(Port(), program.ROOT)
    tell("program")
    app.home((1 << app.joints) - 1, steps)
    app.engine.start = lambda homing: None  # nothing moves here: a motion is loaded, its rings are full
    app.begin("go", 0)
    tell("motion")
    for _ in range(10):
        app.engine.service()
    tell("turns")
    print("@ end", app.fault())
