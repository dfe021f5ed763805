"""The interrupt of TIM6: every 0.5 or 1 ms it writes steps from the queues to the rings, whatever the main loop does.

The compare interrupt and the switches have a higher priority. While no ring is fed its timer is stopped;
``Ring.feed`` starts it. Cost: docs/hardware.md.
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

# Between two interrupts: 0.5 ms, or twice as long if each ring, when full, lasts _LONG_US. It is not filled before
# three eighths are free, nor in its last 390 us.
_PERIOD_TICKS = const(42000)
_LONG_US = const(6300)
_HALF_SECOND_US = const(500000)  # a step takes two entries
_CR1 = const(0)  # of a timer
# what the interrupt takes
_BLOCK = const(0)
_DMA = const(1)
_TIMER2 = const(2)
_TIMER6 = const(3)
_RINGS_TO_REFILL = const(4)
_EMIT = const(5)
_STATES = const(6)


class RingFeeder:
    """``block``: the memory that the interrupts share. Made once; ``connect`` gives it rings.

    ``inputs``: freezes the outputs.
    """

    def __init__(self, block: "array[int]") -> None:
        self.inputs: "Any" = None
        self._hook = _feeder(self, block)
        mem32[stm.TIM6] = 0

    def connect(self, inputs: Inputs, joints: "list[JointDrive]", rates: "list[int]") -> None:
        """Feed the joints' rings; ``inputs`` freezes all if one was written too late.

        ``rates``: the joints' highest step rates.
        """
        self.inputs = inputs
        prescaler = 1
        for joint, rate in zip(joints, rates):
            self.take_queue(joint)
            if joint.ring.entries * _HALF_SECOND_US < _LONG_US * rate:
                prescaler = 0
        Timer(6, prescaler=prescaler, period=_PERIOD_TICKS - 1, callback=self._hook)  # type: ignore[arg-type]
        mem32[stm.TIM6] = 0

    def take_queue(self, joint: JointDrive) -> None:
        """Use the queue of the joint's present generator; nothing moves."""
        isr.set_places(joint.ring.state, joint.ring.words, joint.generator.queue)

    def disconnect(self) -> None:
        """Release the rings; none is fed any more."""
        mem32[stm.TIM6] = 0
        self.inputs = None


def _feeder(owner: RingFeeder, block: "array[int]") -> "Callable[[object], object]":
    """The interrupt's callback.

    Looking up a name takes 110 to 150 instructions, an object's memory 150 to 250, a call 600 to 800. So all
    rings are written in one call. A closure with more than four free variables would allocate when called.
    """
    states = memoryview(block)[isr.BLOCK_HEAD + isr.RING :]
    calls: "Any" = (block, stm.DMA1, stm.TIM2, stm.TIM6, isr.rings_to_refill, emit, states)

    @micropython.viper
    def feed(timer: object) -> object:
        wanted = int(calls[_RINGS_TO_REFILL](calls[_BLOCK], calls[_DMA], calls[_TIMER2]))
        if wanted < 0:
            ptr32(calls[_TIMER6])[_CR1] = 0
        elif wanted:
            late = int(calls[_EMIT](wanted, calls[_STATES], calls[_TIMER2]))
            if late:
                owner.inputs.freeze()
                joint = 0
                while not late & 1:
                    late >>= 1
                    joint += 1
                isr.set_fault(calls[_BLOCK], codes.UNDERRUN, joint)

    return feed
