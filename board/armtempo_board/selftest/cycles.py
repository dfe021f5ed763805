"""Cost of work in cycles of the processor."""

import gc

import micropython

from armtempo_board.selftest.common import cost, count_cycles, cycles, feed

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any


@micropython.viper
def counting(passes: int) -> int:
    """A loop in machine code."""
    total = 0
    for number in range(passes):
        total += number
    return total


def plain(passes: int) -> int:
    """The same in byte code."""
    total = 0
    for number in range(passes):
        total += number
    return total


def emitted(entries: int) -> int:
    """Cycles of the ring interrupt's ``emit`` for ``entries`` edges of a long cubic."""
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
    state[isr.MASK], state[isr.SPACE] = 1023, entries
    isr.set_places(state, ring, queue)
    return cost(step_queue.emit, 1, state, array("i", [0] * 18), times=1)


def evaluated(motion: bytes) -> "tuple[int, int]":
    """(cycles, edges) of the evaluator for all steps of a motion from step 0, with a ring."""
    from array import array

    from armtempo_shared import engine_memory
    from armtempo_shared.motion import Motion

    from armtempo_board.hardware import isr
    from armtempo_board.memory import Memory
    from armtempo_board.stepgen.step_generator import StepGenerator

    generator = StepGenerator(Memory(list(engine_memory.GENERATOR_PARTS)))
    state = array("i", [0] * isr.STATE_WORDS)
    state[isr.MASK] = 1023
    isr.set_places(state, array("i", [0] * 1025), generator.queue)
    record = Motion(motion)
    gc.collect()
    before = cycles()
    generator.load(record, 0, 0, 168, 20000)
    edges = 0
    while generator.waits() or not generator.ended:
        generator.prepare(1 << 28)
        edges += generator.write(state, edges & 1023, 1000, state)
    return (cycles() - before) & 0xFFFFFFFF, edges


def nothing() -> None:
    """For the cost of reading the counter."""


def measure(motion: str) -> "dict[str, Any]":
    """Cycles of each, without the reading of the counter."""
    from binascii import unhexlify

    feed()
    count_cycles()
    gc.collect()
    empty = cost(nothing)
    found: "dict[str, Any]" = {"empty": empty}
    found["byte_code"] = (cost(plain, 1100) - cost(plain, 100)) / 1000
    found["machine_code"] = (cost(counting, 1100) - cost(counting, 100)) / 1000
    found["edges"] = min([emitted(512) for _ in range(3)]) - min([emitted(2) for _ in range(3)])
    found["evaluator"], found["evaluator_edges"] = evaluated(unhexlify(motion))
    found["collection"] = cost(gc.collect, times=3) - empty
    return found
