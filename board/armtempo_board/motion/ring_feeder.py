"""The interrupt of TIM6: every 0.5 ms it writes steps from the queues to the rings, whatever the main loop does.

The compare interrupt and the switches rank above it and may interrupt it. While no ring is fed it stops its timer; who
feeds one starts it (``Ring.feed``). What it costs: docs/hardware.md.
"""

import micropython
import stm
from armtempo_shared import codes
from machine import mem32
from micropython import const
from pyb import Timer

from armtempo_board.hardware import isr
from armtempo_board.hardware.inputs import Inputs
from armtempo_board.motion.joint_drive import JointDrive
from armtempo_board.stepgen.step_queue import emit

TYPE_CHECKING = False
if TYPE_CHECKING:
    from array import array
    from collections.abc import Callable
    from typing import Any

_PERIOD_TICKS = const(42000)
_CR1 = const(0)  # of TIM6
# what the interrupt takes
_BLOCK = const(0)
_DMA = const(1)
_TIMER2 = const(2)
_TIMER6 = const(3)
_RINGS_TO_REFILL = const(4)
_EMIT = const(5)
_NOTE_WRITTEN = const(6)
# and of each joint
_STATE = const(0)
_WORDS = const(1)
QUEUE = const(2)
PARTS = const(3)
# as in isr.py: words of a ring's state
_MASK = const(5)
_ROOM = const(8)


class RingFeeder:
    """``block``: the memory that the interrupts share. It is made once; ``connect`` gives it rings.

    ``inputs``: what freezes the outputs.
    """

    def __init__(self, block: "array[int]") -> None:
        self.inputs: "Any" = None
        self.parts: "list[Any]" = []
        self._hook = _feeder(self, block, self.parts)
        mem32[stm.TIM6] = 0

    def connect(self, inputs: Inputs, joints: "list[JointDrive]") -> None:
        """Feed the joints' rings; ``inputs`` freezes all where one was written too late."""
        self.inputs = inputs
        self.parts.clear()
        for joint in joints:
            self.parts += (joint.ring.state, joint.ring.words, joint.generator.queue)
        Timer(6, prescaler=0, period=_PERIOD_TICKS - 1, callback=self._hook)  # type: ignore[arg-type]
        mem32[stm.TIM6] = 0

    def disconnect(self) -> None:
        """Hold no ring; none is fed any more."""
        mem32[stm.TIM6] = 0
        self.inputs = None
        self.parts.clear()


def _feeder(owner: RingFeeder, block: "array[int]", parts: "list[Any]") -> "Callable[[object], object]":
    """What the interrupt does.

    Looking up a name takes 110 to 150 instructions, so none is looked up for a joint. A call with more than four
    variables from outside would allocate.
    """
    calls: "Any" = (block, stm.DMA1, stm.TIM2, stm.TIM6, isr.rings_to_refill, emit, isr.note_written)

    @micropython.viper
    def feed(timer: object) -> object:
        timer2 = calls[_TIMER2]
        wanted = int(calls[_RINGS_TO_REFILL](calls[_BLOCK], calls[_DMA], timer2))
        if wanted < 0:
            ptr32(calls[_TIMER6])[_CR1] = 0
            wanted = 0
        joint = 0
        while wanted:
            if wanted & 1:
                state = parts[joint + _STATE]
                words = parts[joint + _WORDS]
                queue = parts[joint + QUEUE]
                ring = ptr32(state)
                calls[_EMIT](ring[_ROOM], words, queue, ring[_MASK])
                if int(calls[_NOTE_WRITTEN](state, words, timer2, queue)):
                    owner.inputs.freeze()
                    isr.set_fault(calls[_BLOCK], codes.UNDERRUN, joint // PARTS)
            wanted >>= 1
            joint += PARTS

    return feed
