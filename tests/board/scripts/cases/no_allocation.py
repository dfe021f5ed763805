"""The main loop and the interrupt with the heap locked: MemoryError if anything allocates.

Registers are plain memory here; the counter, the streams and the interrupt are moved by this script.
"""

import gc
import sys

import micropython

sys.path.insert(0, __file__.rsplit("/", 2)[0] + "/rigs/bare")

from array import array

import pyb
import stm
from arm_rows import HEAD, arm
from armtempo_board.hardware import isr, registers  # noqa: F401  they are forgotten again: not counted
from armtempo_board.motion import motion_check  # noqa: F401  they are forgotten again: not counted
from armtempo_board.motion.engine import Engine
from armtempo_board.motion.engine_memory import EngineMemory
from armtempo_board.motion.engine_parts import EngineParts
from armtempo_shared import armrecord, engine_memory  # noqa: F401
from brake_motion import record

STEP_TICKS = 30_000
BUFFER = array("i", [0] * 10)
ENGINE_MEMORY = EngineMemory(engine_memory.LARGEST_BYTES)
ENGINE_MEMORY.make_memory(12 * 1026)


def compare_of(ring):
    """Word of the ring's compare register in its timer."""
    return ring._block[ring._at + isr.CCR_AT]


class Streams:
    """Plays the compare matches and the DMA of a ring."""

    def __init__(self, ring):
        self.ring = ring
        self.matched = 0

    def play(self, now):
        """Let match what lies before ``now`` (ticks, modulo 2**32)."""
        ring = self.ring
        at = (ring._registers - stm.DMA1) // 4 + isr.STREAM_NDTR
        dma = stm.BLOCKS["DMA1"]
        timer = stm.BLOCKS["TIM5" if ring.timer == stm.TIM5 else "TIM2"]
        if not dma[at - 1] & 1 or not timer[isr.DIER] >> (8 + compare_of(ring) - isr.CCR1 + 1) & 1:
            return
        entries = ring.entries
        loads = (entries - dma[at]) % entries
        while (now - timer[compare_of(ring)]) & 0xFFFFFFFF < 1 << 31:
            loads += 1
            timer[compare_of(ring)] = ring.words[(loads - 1) % entries + 1] & 0xFFFFFFFF
            self.matched += 1
        dma[at] = (entries - loads) % entries or entries


def move_to(now, streams):
    """All that the hardware does until ``now``, the compare interrupt at its time."""
    timer = stm.BLOCKS["TIM2"]
    while timer[isr.DIER] & 16 and (now - timer[isr.CCR4]) & 0xFFFFFFFF < 1 << 30:
        show((timer[isr.CCR4] + 200) & 0xFFFFFFFF, streams)
        locked(pyb.Timer.callbacks[2, 4], 4)
    show(now & 0xFFFFFFFF, streams)
    if stm.BLOCKS["TIM6"][isr.CR1] & 1:
        locked(pyb.Timer.callbacks[6, 0], 6)


def show(counter, streams):
    """Bring the registers to a time."""
    for name in ("TIM2", "TIM5"):
        stm.BLOCKS[name][isr.CNT] = counter
    for stream in streams:
        stream.play(counter)
    stm.BLOCKS["TIM1"][isr.CNT] = streams[0].matched // 2 * 5 // 16 & 0xFFFF


def locked(function, argument=None):
    """Call with the heap locked; without an argument if it is None."""
    micropython.heap_lock()
    try:
        if argument is None:
            return function()
        return function(argument)
    finally:
        micropython.heap_unlock()


def run(joints, brake_at, backlash=()):
    """A whole motion, braked at a time (or not)."""
    stm.BLOCKS["TIM1"][isr.CNT] = 0
    engine = Engine(EngineParts(HEAD, joints, ENGINE_MEMORY, backlash))
    engine.home(7, [0, 0, 0])
    motion = record()
    engine.load(motion)
    streams = [Streams(joint.ring) for joint in engine.drives]
    now = stm.BLOCKS["TIM2"][isr.CNT] - (1 << 32)
    engine.moving = True
    samples = 0
    while engine.moving:
        now += STEP_TICKS
        move_to(now, streams)
        if engine.block[isr.SAMPLES_DONE] or (brake_at and now > brake_at):
            engine.brake() if brake_at else engine.service()
            brake_at = 0
        else:
            locked(engine.service)
            assert not engine.moving or 0 < locked(engine.rest_ms) < 2000
        while locked(engine.next_sample, BUFFER):
            samples += 1
        assert now < 200_000_000
    assert engine.fault == 0, engine.fault
    return samples, [engine.commanded(number) for number in range(3)], [s.matched for s in streams]


def heap(count, backlash=()):
    """Bytes that an engine with that many joints keeps."""
    gc.collect()
    before = gc.mem_alloc()
    engine = Engine(EngineParts(HEAD, arm(count), ENGINE_MEMORY, backlash))
    gc.collect()
    return gc.mem_alloc() - before if engine else 0


JOINTS = arm(3)
for joint in JOINTS[1:]:
    joint["following_counts"] = 0
BACKLASH = [{"steps": steps, "on_motor": 0, "spare": 0, "pace": 20_000} for steps in (0, 40, 0)]
heap(3)  # stale words on the stack keep garbage of the first time alive: the second time counts
heap(3, BACKLASH)
print(heap(3), heap(6), heap(3, BACKLASH))
print(*run(JOINTS, 0))
print(*run(JOINTS, 40_000_000))
print(*run(JOINTS, 0, BACKLASH))
