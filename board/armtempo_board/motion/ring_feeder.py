"""The interrupt of TIM6: every 0.5 ms it writes steps from the queues to the rings, whatever the main loop does.

The compare interrupt and the switches rank above it and may interrupt it. While no ring is fed it stops its timer; who
feeds one starts it (``Ring.feed``). What it costs: docs/hardware.md.
"""

from array import array

import micropython
import stm
import uctypes
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
    from collections.abc import Callable
    from typing import Any

_PERIOD_TICKS = const(42000)
_CR1 = const(0)  # of a timer
# what the interrupt takes
_BLOCK = const(0)
_DMA = const(1)
_TIMER2 = const(2)
_TIMER6 = const(3)
_RINGS_TO_REFILL = const(4)
_EMIT = const(5)
_PLACES = const(6)
# and of each joint: objects,
_WORDS = const(0)
_QUEUE = const(1)
_PARTS = const(2)
# and where they lie: the low 30 bits of an address, and in the next word the rest
_RING_AT = const(0)
_QUEUE_AT = const(2)
_PLACE_WORDS = const(4)
_ADDRESS_WORDS = const(2)
_MOST_JOINTS = const(6)
# as in isr.py: of the block, of a joint in it, of a ring's state
_BLOCK_HEAD = const(22)
_RING = const(16)
_JOINT_WORDS = const(25)
_WRITTEN = const(0)
_LAST_TIME = const(3)
_FAR_TIME = const(4)
_MASK = const(5)
_ROOM = const(8)
_CNT = const(9)  # of a timer
_FIRST_ENTRY = const(0)
# as in step_queue.py: words of the queue
_STEPS = const(11)
_PULSE = const(17)
_HEAD = const(18)
_IN = const(20)
_OUT = const(21)


class RingFeeder:
    """``block``: the memory that the interrupts share. It is made once; ``connect`` gives it rings.

    ``inputs``: what freezes the outputs.
    """

    def __init__(self, block: "array[int]") -> None:
        self.inputs: "Any" = None
        self._parts: "list[Any]" = []
        self._places = array("i", [0] * (_MOST_JOINTS * _PLACE_WORDS))
        self._hook = _feeder(self, block, self._parts, self._places)
        mem32[stm.TIM6] = 0

    def connect(self, inputs: Inputs, joints: "list[JointDrive]") -> None:
        """Feed the joints' rings; ``inputs`` freezes all where one was written too late."""
        self.inputs = inputs
        self._parts.clear()
        for number, joint in enumerate(joints):
            self._parts += (None, None)
            self._put(_PARTS * number + _WORDS, joint.ring.words)
            self.take_queue(number, joint.generator.queue)
        Timer(6, prescaler=0, period=_PERIOD_TICKS - 1, callback=self._hook)  # type: ignore[arg-type]
        mem32[stm.TIM6] = 0

    def take_queue(self, joint: int, queue: "memoryview[int]") -> None:
        """A joint's steps come from this queue; nothing moves."""
        self._put(_PARTS * joint + _QUEUE, queue)

    def _put(self, at: int, part: "Any") -> None:
        self._parts[at] = part
        address = uctypes.addressof(part)
        low = _ADDRESS_WORDS * at
        self._places[low] = address & 0x3FFFFFFF
        self._places[low + 1] = address >> 30

    def disconnect(self) -> None:
        """Hold no ring; none is fed any more."""
        mem32[stm.TIM6] = 0
        self.inputs = None
        self._parts.clear()


def _feeder(
    owner: RingFeeder, block: "array[int]", parts: "list[Any]", places: "array[int]"
) -> "Callable[[object], object]":
    """What the interrupt does.

    Looking up a name takes 110 to 150 instructions, an object's memory 150 to 250, a call 600 to 800. So of a joint
    that has no steps to be written nothing is looked up, and what else could be called stands here: the end of the
    loop is ``isr.note_written``. A call with more than four variables from outside would allocate.
    """
    calls: "Any" = (block, stm.DMA1, stm.TIM2, stm.TIM6, isr.rings_to_refill, emit, places)

    @micropython.viper
    def feed(timer: object) -> object:
        wanted = int(calls[_RINGS_TO_REFILL](calls[_BLOCK], calls[_DMA], calls[_TIMER2]))
        if wanted < 0:
            ptr32(calls[_TIMER6])[_CR1] = 0
        elif wanted:
            state = ptr32(int(ptr32(calls[_BLOCK])) + 4 * (_BLOCK_HEAD + _RING))
            place = ptr32(calls[_PLACES])
            timer2 = ptr32(calls[_TIMER2])
            joint = 0
            while wanted:
                if wanted & 1:
                    queue = ptr32((place[_QUEUE_AT + 1] << 30) + place[_QUEUE_AT])
                    if queue[_STEPS] | (queue[_IN] ^ queue[_OUT]):
                        calls[_EMIT](state[_ROOM], parts[joint + _WORDS], parts[joint + _QUEUE], state[_MASK])
                    written = queue[_HEAD]
                    if written != state[_WRITTEN]:
                        ring = ptr32((place[_RING_AT + 1] << 30) + place[_RING_AT])
                        late = ((state[_LAST_TIME] - queue[_PULSE] - timer2[_CNT]) >> 31) & 1
                        state[_WRITTEN] = written
                        state[_LAST_TIME] = ring[(written - 1) & state[_MASK]]
                        half = 1
                        state[_FAR_TIME] = (half << 31) + state[_LAST_TIME]
                        ring[written & state[_MASK]] = state[_FAR_TIME]
                        ring[state[_MASK] + 1] = ring[_FIRST_ENTRY]
                        if late:
                            owner.inputs.freeze()
                            isr.set_fault(calls[_BLOCK], codes.UNDERRUN, joint // _PARTS)
                wanted >>= 1
                joint += _PARTS
                place = ptr32(int(place) + 4 * _PLACE_WORDS)
                state = ptr32(int(state) + 4 * _JOINT_WORDS)

    return feed
