"""Prepares the next motion, with its first steps, while another one runs.

It has its own step generators. The running motion, pins, rings and clock are not touched before
``hand_over``, when nothing moves. Imported for sequences, if the heap has space
(``armtempo_shared.engine_memory.ahead_bytes``).
"""

import gc
from array import array

from armtempo_shared import codes
from armtempo_shared.engine_memory import GENERATOR_WORDS
from armtempo_shared.limits import LONGEST_RUN_TICKS, MAX_STEP_RATE_SUM
from micropython import const

from armtempo_board.errors import Refused
from armtempo_board.hardware import isr
from armtempo_board.memory import Memory
from armtempo_board.motion import endpoints
from armtempo_board.stepgen.override import Override
from armtempo_board.stepgen.step_generator import StepGenerator

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from typing import Any

    from armtempo_shared.motion import MotionHead

    from armtempo_board.motion.engine import Engine
    from armtempo_board.motion.joint_drive import JointDrive

_RESERVE_KITICKS = const(819)
"""10 ms, in Ki ticks (1024 ticks): so much less than is computed ahead, 19 to 40 ms, has to be queued. A slice of the
work takes 1 to 2 ms at 1.3 cycles an instruction, a garbage collection 5 ms, the checksum of the largest motion 10 ms;
the running motion may need the loop afterwards."""
_FAST_PART = const(4)
"""If the arm's rates exceed this fraction of the highest rates, the running motion needs the loop until its
last step is queued."""
_PERMILLE = const(1000)


class NextMotion:
    """The next motion of an engine. ``is_ready``: it is loaded, to start at ``expected``.

    Raises MemoryError if the heap has no space.
    """

    def __init__(self, engine: "Engine") -> None:
        self._engine = engine
        joints = len(engine.drives)
        memory = Memory([GENERATOR_WORDS] * joints)
        self._generators = [StepGenerator(memory) for _ in range(joints)]
        self._is_fast = sum([row["max_rate"] for row in engine.limits]) > MAX_STEP_RATE_SUM // _FAST_PART
        self._own = [joint.generator for joint in engine.drives]  # whose memory is the engine's
        self.expected = array("i", [0] * joints)  # steps
        self.motion: "Any" = None
        self.override: "Any" = None
        self.is_ready = False

    def pieces(
        self, rate: int, opened: "Callable[[], MotionHead]", stands_at: "Callable[[MotionHead, int], int]"
    ) -> "Iterator[None]":
        """Do the work, one slice per iteration; raises Refused.

        ``rate``: as for ``Engine.load``; ``opened``: returns the motion, whose splines were checked before;
        ``stands_at``: returns the position of a joint before it.
        """
        self.close()
        yield
        gc.collect()  # collect now, not when the heap is full, perhaps at a bad moment of the motion
        yield
        motion = opened()
        for number in range(len(self._generators)):
            yield
            self._expect(motion, number, stands_at(motion, number))
        yield
        override = Override()
        override.begin(rate, motion, endpoints.duration_ticks(motion))
        if override.end_ticks() > LONGEST_RUN_TICKS:
            raise Refused(codes.TOO_LONG)
        pulse_ticks = self._engine.block[isr.PULSE_TICKS]
        for number, generator in enumerate(self._generators):
            yield
            gap_ticks = self._engine.drives[number].gap_ticks
            generator.begin(motion, number, self.expected[number], pulse_ticks, gap_ticks)
            while generator.seek():
                yield
            if rate != _PERMILLE:
                yield
                generator.follow(override.law, False)
            while generator.prepare(self._engine.drives[number].lookahead_kiticks):
                yield
        self.motion = motion
        self.override = override
        self.is_ready = True

    def _expect(self, motion: "MotionHead", joint: int, position: int) -> None:
        """Raise Refused if the joint cannot be there."""
        off = endpoints.start_offset(motion, joint, position)
        if off:
            raise Refused(codes.WRONG_START, joint, off)
        self.expected[joint] = position

    def has_time(self) -> bool:
        """Whether the running motion needs no ``Engine.refill`` during a slice: its queues hold its last
        steps, or many."""
        now_kiticks = self._engine.clock.kiticks()
        for joint in self._engine.drives:
            generator = joint.generator
            if generator.ended:
                continue
            if (
                self._is_fast
                or joint.can_queue_more
                or generator.at_reversal
                or generator.latest_kiticks() < now_kiticks + joint.lookahead_kiticks - _RESERVE_KITICKS
            ):
                return False
        return True

    def starts_from_here(self) -> bool:
        """Whether it is ready, and all joints are at its start."""
        engine = self._engine
        for joint, expected in enumerate(self.expected):
            if not engine.known >> joint & 1 or engine.commanded(joint) != expected:
                return False
        return self.is_ready

    def hand_over(self, number: int, joint: "JointDrive") -> None:
        """Exchange a joint's generator for the prepared one; nothing moves."""
        generator = self._generators[number]
        self._generators[number] = joint.generator
        self._put(number, joint, generator)
        joint.prepare_start()

    def give_back(self) -> None:
        """Give all joints their former generators again; this object is not used any more; nothing moves."""
        self.close()
        for number, joint in enumerate(self._engine.drives):
            self._put(number, joint, self._own[number])

    def _put(self, number: int, joint: "JointDrive", generator: StepGenerator) -> None:
        joint.generator = generator
        self._engine.feeder.take_queue(joint)

    def close(self) -> None:
        """Close the motion: it is not needed, or it was handed over."""
        self.is_ready = False
        self.motion = self.override = None
        for generator in self._generators:
            generator.close()
