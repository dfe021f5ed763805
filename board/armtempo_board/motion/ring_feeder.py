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
    from typing import Any

_PERIOD_TICKS = const(42000)
_CR1 = const(0)  # of TIM6


class RingFeeder:
    """``block``: the memory that the interrupts share. It is made once; ``connect`` gives it rings."""

    def __init__(self, block: "array[int]") -> None:
        self._block = block
        self._dma, self._timer2, self._timer6 = stm.DMA1, stm.TIM2, stm.TIM6
        self._hook = self.feed  # bound once
        self.disconnect()

    def connect(self, inputs: Inputs, joints: "list[JointDrive]") -> None:
        """Feed the joints' rings; ``inputs`` freezes all where one was written too late."""
        self._inputs: "Any" = inputs
        self._words = [joint.ring.words for joint in joints]
        self._masks = [joint.ring.entries - 1 for joint in joints]
        self._states = [joint.ring.state for joint in joints]
        self._queues = [joint.generator.queue for joint in joints]
        Timer(6, prescaler=0, period=_PERIOD_TICKS - 1, callback=self._hook)  # type: ignore[arg-type]
        mem32[stm.TIM6] = 0

    def disconnect(self) -> None:
        """Hold no ring; none is fed any more."""
        mem32[stm.TIM6] = 0
        self._inputs = None
        self._words = self._masks = self._states = self._queues = ()  # type: ignore[assignment]

    @micropython.viper
    def feed(self, timer: object) -> object:
        """What the interrupt does."""
        wanted = int(isr.rings_to_refill(self._block, self._dma, self._timer2))
        if wanted < 0:
            ptr32(self._timer6)[_CR1] = 0
            wanted = 0
        joint = 0
        while wanted:
            if wanted & 1:
                words = self._words[joint]
                state = self._states[joint]
                queue = self._queues[joint]
                emit(state[isr.ROOM], words, queue, self._masks[joint])
                if int(isr.note_written(state, words, self._timer2, queue)):
                    self._inputs.freeze()
                    isr.set_fault(self._block, codes.UNDERRUN, joint)
            wanted >>= 1
            joint += 1
