"""What work takes, in cycles of the processor."""

import micropython


@micropython.viper
def counting(turns: int) -> int:
    """A loop in machine code."""
    total = 0
    for turn in range(turns):
        total += turn
    return total


def plain(turns):
    """The same as byte code."""
    total = 0
    for turn in range(turns):
        total += turn
    return total


def nothing():
    """What reading the counter costs."""


def measure():
    """Cycles of each; the reading of the counter is taken off."""
    feed()
    count_cycles()
    gc.collect()
    empty = cost(nothing)
    found = {"empty": empty}
    found["byte_code"] = (cost(plain, 1100) - cost(plain, 100)) / 1000
    found["machine_code"] = (cost(counting, 1100) - cost(counting, 100)) / 1000
    found["collection"] = cost(gc.collect, times=3) - empty
    return found
