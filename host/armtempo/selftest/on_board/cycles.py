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


def emitted(entries):
    """Cycles in which the ring interrupt's ``emit`` writes so many edges of a long cubic to a ring."""
    from array import array

    from armtempo_board.hardware import isr
    from armtempo_board.stepgen import step_queue

    queue = array("i", [0] * step_queue.QUEUE_SIZE)
    queue[step_queue.FIRST] = 252 << 22
    queue[step_queue.SECOND] = queue[step_queue.THIRD] = 1 << 29
    queue[step_queue.POWER], queue[step_queue.SHIFT], queue[step_queue.GROUP] = 9, 13, 5
    queue[step_queue.STEPS], queue[step_queue.UNTIL_KITICKS], queue[step_queue.PULSE] = 512, 1 << 28, 168
    ring = array("i", [0] * 1025)
    state = array("i", [0] * isr.STATE_WORDS)
    state[isr.MASK], state[isr.ROOM] = 1023, entries
    isr.set_places(state, ring, queue)
    return cost(step_queue.emit, 1, state, array("i", [0] * 18), times=1)


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
    found["edges"] = min([emitted(512) for _ in range(3)]) - min([emitted(2) for _ in range(3)])
    found["collection"] = cost(gc.collect, times=3) - empty
    return found
