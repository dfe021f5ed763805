"""The drive of one joint: step generator, ring, DIR pin, and step count.

The generator puts steps into its queue; an interrupt (ring_feeder.py) writes them to the ring. Ki ticks are
1024 ticks, 12.2 us.
"""

from array import array

import stm
from armtempo_shared import codes
from armtempo_shared.limits import REVERSAL_SLACK_TICKS
from micropython import const
from pyb import Pin

from armtempo_board.hardware import isr, pins
from armtempo_board.hardware.ring import Ring
from armtempo_board.hardware.sampler import Sampler
from armtempo_board.memory import Memory
from armtempo_board.stepgen.step_generator import StepGenerator

TYPE_CHECKING = False
if TYPE_CHECKING:
    from armtempo_shared.motion import MotionHead

# How far ahead steps are computed: 25 ms, for which the loop may be busy with something else, and 4.2 ms for each joint
_LOOP_KITICKS = const(2048)
_JOINT_KITICKS = const(341)

_GUARD_KITICKS = const(16)  # 195 us: a change of DIR is queued only after an edge that is later than this
_OVERDUE_KITICKS = const(-164)  # 2 ms ago: the interrupt that fills the rings has failed
_REFILL_KITICKS = const(512)  # at most 6 ms between two checks of a queue that is full or long enough
_NEVER_KITICKS = const(1 << 29)
_NOT_FED = const(-(1 << 22))  # as in ring.py
_LATEST_KITICKS = const(22)  # of the queue, as in step_queue.py
_REVERSALS = const(8)


class JointDrive:
    """``arm``: head and joints of the arm record; ``sampler`` has the memory that the interrupts read.

    ``ring_words``: see ``Ring``; ``memory``: for the step generator. ``lookahead_kiticks``: how far ahead steps are
    computed, 29 ms with one joint, 50 ms with six.
    """

    extra_counts = 0
    """What the encoder has counted of steps that are not of the position (backlash_drive.py)."""

    def __init__(
        self,
        number: int,
        arm: "tuple[dict[str, int], list[dict[str, int]]]",
        sampler: Sampler,
        ring_words: "memoryview",
        memory: Memory,
    ) -> None:
        head, rows = arm
        row = rows[number]
        self._sampler = sampler
        self.lookahead_kiticks = _LOOP_KITICKS + _JOINT_KITICKS * len(rows)
        block = sampler.block
        self._words_at = sampler.joint_at(number)
        self.ring = Ring(row["channel"], block, self._words_at, ring_words)
        self.generator = StepGenerator(memory)
        self._inverted = row["dir_inverted"]
        self._reversal_delay = head["dir_hold_ticks"] + REVERSAL_SLACK_TICKS
        self.gap_ticks = max(
            head["pulse_ticks"] + self._reversal_delay + REVERSAL_SLACK_TICKS + head["dir_setup_ticks"],
            head["pulse_ticks"] + head["low_ticks"],
        )
        name = pins.DIR[row["channel"]]
        self._dir = Pin(name, Pin.OUT_PP, value=0)
        block[self._words_at + isr.DIR_BIT] = 1 << pins.line(name)
        block[isr.PULSE_TICKS] = head["pulse_ticks"]
        block[isr.REVERSAL_SLACK_TICKS] = REVERSAL_SLACK_TICKS
        block[isr.DIR_SETUP_TICKS] = head["dir_setup_ticks"]
        self._reversal_steps = array("i", [0] * _REVERSALS)  # steps of the ring before each queued reversal
        self._direction = 1
        self._count_from(0)
        self.ended = True
        self.can_queue_more = False  # at once, as the last call of ``refill`` took only a limited time
        self._next_refill_kiticks = 0

    def _count_from(self, position: int) -> None:
        """Restart the count of the ring at a position."""
        self._base = position
        self._base_steps = 0
        self._reversals_in = self._reversals_out = 0

    def load(self, motion: "MotionHead", number: int, moves: int) -> None:
        """Prepare for a motion; the clock is before 0. ``moves``: as of ``StepGenerator.load``."""
        pulse_ticks = self._sampler.block[isr.PULSE_TICKS]
        self.generator.load(motion, number, self._base, pulse_ticks, self.gap_ticks, moves)
        self.prepare_start()

    def prepare_start(self) -> None:
        """Prepare for the motion that the generator has loaded."""
        self._direction = self.generator.direction
        self._dir.value((self._direction > 0) ^ self._inverted)
        self.ring.release()  # a motion may have been loaded and never started
        self.ring.stop()
        self._count_from(self._base)
        self.ended = False
        self._next_refill_kiticks = -_NEVER_KITICKS  # nothing is to be done before

    def position(self, matches: int) -> int:
        """Commanded steps after ``matches`` matches of the ring; call it in the order of the matches."""
        steps = (matches + 1) >> 1
        while self._reversals_out != self._reversals_in:
            reversed_at = self._reversal_steps[self._reversals_out & (_REVERSALS - 1)]
            if reversed_at > steps:
                break
            self._base += self._direction * (reversed_at - self._base_steps)
            self._base_steps = reversed_at
            self._direction = -self._direction
            self._reversals_out += 1
        return self._base + self._direction * (steps - self._base_steps)

    def is_astray(self, at_rest: bool) -> bool:
        """Whether the ending motion made other steps than its record has; see ``StepGenerator.end_steps``."""
        return self.position(self.ring.matches()) != self.generator.end_steps(at_rest)

    def ahead_kiticks(self) -> int:
        """Time until the last step in the ring, Ki ticks, rounded up."""
        ahead_kiticks = self.ring.fed_kiticks()
        return 0 if ahead_kiticks == _NOT_FED else ahead_kiticks + 1

    def refill(self, now_kiticks: int) -> int:
        """Fill the queue; returns the code of a fault, or 0."""
        self.can_queue_more = False
        if now_kiticks < self._next_refill_kiticks:
            return 0
        generator = self.generator
        can_queue_more = self.can_queue_more = generator.prepare(now_kiticks + self.lookahead_kiticks)
        if can_queue_more and self.ring.state[isr.FED]:
            return 0  # served once the queue is full
        ahead_kiticks = self.ring.fed_kiticks()
        if ahead_kiticks == _NOT_FED:
            return self._restart(now_kiticks) if self._sampler.quiet() else 0
        if (
            generator.at_reversal
            and not generator.waits()
            and ahead_kiticks > _GUARD_KITICKS
            and self._reverse()
        ):
            self.can_queue_more = True
        elif not can_queue_more:  # the queue is full, or long enough
            wait_kiticks = generator.queue[_LATEST_KITICKS] - now_kiticks >> 3
            if wait_kiticks > _REFILL_KITICKS:
                wait_kiticks = _REFILL_KITICKS
            self._next_refill_kiticks = now_kiticks + wait_kiticks
        return codes.INTERNAL if ahead_kiticks < _OVERDUE_KITICKS else 0

    def _reverse(self) -> bool:
        """Queue the change of DIR at which the generator waits; returns False while the queue is full."""
        if self._reversals_in - self._reversals_out >= _REVERSALS:
            return False
        if not isr.add_reversal(self._sampler.block, self.ring.state, self._words_at, self._reversal_delay):
            return False
        self._reversal_steps[self._reversals_in & (_REVERSALS - 1)] = self.ring.written() >> 1
        self._reversals_in += 1
        self.generator.reverse()
        isr.interrupt_soon(stm.TIM2)
        return True

    def _restart(self, now_kiticks: int) -> int:
        """Fill an empty ring from its start when the next steps are near."""
        ring = self.ring
        generator = self.generator
        if not generator.waits():
            if generator.ended:
                ring.release()
                self.ended = True
                self._next_refill_kiticks = _NEVER_KITICKS
            elif generator.at_reversal:
                ring.set_last_to_now()
                self._reverse()
            elif generator.halted:
                ring.park_compare()
                self._next_refill_kiticks = now_kiticks + _REFILL_KITICKS
            return 0
        if generator.next_kiticks() - now_kiticks > self.lookahead_kiticks:
            ring.park_compare()
            self._next_refill_kiticks = now_kiticks + _REFILL_KITICKS
            return 0
        if ring.written():
            self.empty()
        if not generator.write(ring.state, 0, ring.entries - isr.SPARE_ENTRIES, ring.timer):
            return 0
        return codes.UNDERRUN if ring.run() else 0

    def follow(self, law: "array[int]", is_last: bool) -> None:
        """Follow another time law (see ``StepGenerator.follow``)."""
        ring = self.ring
        self.generator.follow(law, is_last, ring.state)
        if ring.state[isr.FED]:
            ring.feed()  # the interrupt may have found no ring that it writes to, and stopped
        self._next_refill_kiticks = -_NEVER_KITICKS

    def finish(self) -> None:
        """End the motion where its time stops."""
        self.generator.finish()
        self._next_refill_kiticks = -_NEVER_KITICKS

    def empty(self) -> None:
        """Empty the ring; the position stays."""
        self._count_from(self.position(self.ring.matches()))
        self.ring.stop()

    def settle(self) -> None:
        """After a freeze: count the last step.

        A rising edge that DMA had not yet counted is detected by the high level of the pin.
        """
        block, at = self._sampler.block, self._words_at
        port = block[isr.HIGH_B] if block[at + isr.ON_PORT_B] else block[isr.HIGH_A]
        matches = self.ring.matches()
        if port >> block[at + isr.PIN_BIT] & 1 and matches & 1 == 0:
            self.position(matches)
            self._base += self._direction
        self.ring.release()
        self.ended = True

    def close(self) -> None:
        """Close the motion; stop the DMA stream of the ring."""
        self.generator.close()
        self.ring.stop()

    def declare(self, steps: int, was_known: int) -> None:
        """Set the position to ``steps``; nothing moves. ``was_known``: all steps since it was declared before."""
        self._base = steps
