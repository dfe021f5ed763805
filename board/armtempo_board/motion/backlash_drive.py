"""The drive of a joint with backlash: after a reversal it adds the steps that only cross the play of the gear.

They come at once with the joint's own steps and speed up and slow down evenly (crossing.py), in real time. While a
crossing lasts, the main loop takes the generator's steps from its queue, merges both and puts them into a queue of its
own, from which the interrupt fills the ring; else this is a plain drive. What the generator does is not changed.

Which of the steps after a reversal are the extra ones is a matter of counting: here the first ones. So the commanded
position stands still until the play is crossed, as the joint does, and is exact after it.
"""

from array import array

from armtempo_shared import codes
from armtempo_shared.limits import TICK_HZ
from micropython import const

from armtempo_board.hardware import isr
from armtempo_board.hardware.ring import NOT_FED
from armtempo_board.hardware.sampler import Sampler
from armtempo_board.memory import Memory
from armtempo_board.motion import crossing
from armtempo_board.motion.following_error import FollowingError
from armtempo_board.motion.joint_drive import JointDrive
from armtempo_board.motion.rate_control import RateControl
from armtempo_board.stepgen import step_queue
from armtempo_board.stepgen.step_queue import emit

_TAP_ENTRIES = const(64)
_TAP_SPACE = const(56)  # of them: ``emit`` writes one entry more
_TAP_STEPS = const(28)  # in that space
_PAST_KITICKS = const(8192)  # 100 ms, more than is computed ahead
_MERGED_KITICKS = const(256)  # 3 ms between two calls of ``merge``: an item then has more than one step
_THIS_RING = const(1)
_SPACING_PERCENT = const(101)  # the arm record has 1 % more than the highest rate
_ALWAYS = const((1 << 29) - 1)  # in Ki ticks: later than any step
# as in joint_drive.py
_GUARD_KITICKS = const(16)
_OVERDUE_KITICKS = const(-164)
_REVERSALS = const(8)
# as in step_queue.py: words of a queue
_STEPS = const(11)
_PULSE = const(17)
_HEAD = const(18)
_IN = const(20)
_OUT = const(21)
_UNTIL_KITICKS = const(13)
_LATEST_KITICKS = const(22)
_FULL = const(15)
_COUNT_MASK = const(0xFFFF)
# as in isr.py: words of a ring's state
_SPACE = const(8)
_QUEUE_AT = const(11)


class BacklashDrive(JointDrive):
    """As ``JointDrive``; ``backlash``: the joint's row of ``armrecord.BACKLASH``; ``rates``: of the engine."""

    _left = 0  # of the play in front of the motor, in steps, by the matches

    def __init__(
        self,
        number: int,
        arm: "tuple[dict[str, int], list[dict[str, int]]]",
        sampler: Sampler,
        ring_words: "memoryview",
        memory: Memory,
        backlash: "dict[str, int]",
        rates: RateControl,
    ) -> None:
        self._rates = rates
        self._play = backlash["steps"]
        self._is_side_known = False
        self._is_crossing = False
        self._motor_ahead = self._declared_ahead = 0  # of the position, in steps, but for a constant
        head, rows = arm
        self._following = FollowingError(rows[number]) if backlash["on_motor"] else None
        self.extra_counts = 0
        self._crossed = array("i", [0] * _REVERSALS)  # by each queued reversal: play to be crossed after it
        self._queue = array("i", bytes(4 * step_queue.QUEUE_SIZE))
        # the generator's queue is written to it like to a ring
        self._tap = array("I", bytes(4 * isr.STATE_WORDS))
        self._tap[isr.MASK] = _TAP_ENTRIES - 1
        self._tap_words = array("i", bytes(4 * (_TAP_ENTRIES + 1)))
        self._crossing = array("i", bytes(4 * crossing.SIZE))
        self._crossing[crossing.PACE] = backlash["pace"]
        # where the generator's queue and the own one are, as QUEUE_AT has it
        self._source_place = array("I", bytes(4 * 2))
        self._own_place = array("I", bytes(4 * 2))
        super().__init__(number, arm, sampler, ring_words, memory)
        fastest = TICK_HZ * _SPACING_PERCENT // (100 * rows[number]["max_rate"])
        self._crossing[crossing.SPACING] = max(fastest, head["pulse_ticks"] + head["low_ticks"])

    # position

    def _count_from(self, position: int) -> None:
        super()._count_from(position)
        self._base_steps = self._left

    def position(self, matches: int) -> int:
        """As of ``JointDrive``: after a reversal, the steps that cross the play are not counted."""
        steps = (matches + 1) >> 1
        while self._reversals_out != self._reversals_in:
            at = self._reversals_out & (_REVERSALS - 1)
            reversed_at, left = self._reversal_steps[at], self._crossed[at]
            if reversed_at > steps:
                break
            # what was not crossed before need not be crossed now, nor is it a step of the joint that is missing
            self._base += self._direction * (reversed_at - self._base_steps + self._play - left)
            self._base_steps = reversed_at + left
            self._direction = -self._direction
            self._reversals_out += 1
        left = self._left = max(self._base_steps - steps, 0)
        ahead = -left if self._direction > 0 else left - self._play
        if ahead != self._motor_ahead:
            self._set_ahead(ahead)
        return self._base + self._direction * max(steps - self._base_steps, 0)

    def _set_ahead(self, steps: int) -> None:
        self._motor_ahead = steps
        if self._following:
            self.extra_counts = self._following.expected(steps - self._declared_ahead)

    def declare(self, steps: int, was_known: int) -> None:
        """As of ``JointDrive``; the encoder is declared with it. If not all steps were counted, the side is unknown."""
        super().declare(steps, was_known)
        self._declared_ahead = self._motor_ahead
        self.extra_counts = 0
        if not was_known:
            self._is_side_known = False

    def side(self) -> "tuple[int, int] | None":
        """In which direction the motor pushes, and how many steps before it does; None if that is not known."""
        return (self._direction, self._left) if self._is_side_known else None

    def take_side(self, direction: int, left: int) -> None:
        """As ``side`` was in an engine before this one; the position is declared."""
        self._is_side_known = True
        self._direction = direction
        left = self._left = self._base_steps = min(left, self._play)
        self._motor_ahead = self._declared_ahead = -left if direction > 0 else left - self._play

    def settle(self) -> None:
        """As of ``JointDrive``; the last step may be one that crosses the play."""
        self.position(self.ring.matches())
        before = self._base
        super().settle()
        if self._base != before:
            self._base = before
            self._base_steps -= 1

    def is_astray(self, at_rest: bool) -> bool:
        """As of ``JointDrive``; in a crossing, which a pause may interrupt, it cannot be told."""
        return not self._is_crossing and super().is_astray(at_rest)

    # motion

    def prepare_start(self) -> None:
        """As of ``JointDrive``. If the joint turns, the crossing begins at time 0."""
        before, generator = self._direction, self.generator
        super().prepare_start()
        state = self.ring.state
        isr.set_places(self._tap, self._tap_words, generator.queue)
        isr.set_places(state, self.ring.words, self._queue)
        for word in range(len(self._own_place)):
            self._own_place[word] = state[_QUEUE_AT + word]
            self._source_place[word] = state[_QUEUE_AT + word] = self._tap[_QUEUE_AT + word]
        self._is_crossing = False
        if generator.ended and not generator.waits():  # it stands
            self._direction = before
            return
        if not self._is_side_known:
            self._is_side_known = True
            self._left = 0
            self._motor_ahead = self._declared_ahead = 0 if self._direction > 0 else -self._play
        elif self._direction != before:
            self._left = self._play - self._left
        self._base_steps = self._left
        if self._left:
            crossing.start_at_0(self._crossing, self._left)
            self._begin()

    def _begin(self) -> None:
        """Fill the ring from the own queue; the generator's is empty, or nothing moves yet."""
        queue = self._queue
        queue[_STEPS] = 0
        queue[_OUT] = queue[_IN]
        queue[_PULSE] = self.generator.queue[_PULSE]
        queue[_UNTIL_KITICKS] = _ALWAYS
        self._crossing[crossing.NEXT] = self._crossing[crossing.COUNT] = 0
        self._is_crossing = True
        self._fill_from(queue, self._own_place)
        self._next_refill_kiticks = -_ALWAYS

    def _fill_from(self, queue: "array[int] | memoryview[int]", place: "array[int]") -> None:
        """Let the interrupt take steps from a queue, which is at ``place``."""
        state = self.ring.state
        fed = state[isr.FED]
        state[isr.FED] = 0  # the interrupt must not come between the two words
        queue[_HEAD] = state[isr.WRITTEN]
        for word in range(len(place)):
            state[_QUEUE_AT + word] = place[word]
        if fed:
            self.ring.feed()

    def _reverse(self) -> bool:
        """As of ``JointDrive``, and begin to cross the play, as far as it is not in front of the motor already."""
        left = self._play
        if self._is_crossing:
            left -= self._crossing[crossing.LEFT]
        reversal = self._reversals_in
        if not super()._reverse():
            return False
        self._crossed[reversal & (_REVERSALS - 1)] = left
        crossing.start_after(self._crossing, left, self.ring.state, self.ring.timer, self.gap_ticks)
        self._begin()
        return True

    def _leave(self) -> None:
        self._is_crossing = False
        self._fill_from(self.generator.queue, self._source_place)
        self._next_refill_kiticks = -_ALWAYS

    def refill(self, now_kiticks: int) -> int:
        """As of ``JointDrive``."""
        if not self._is_crossing:
            return super().refill(now_kiticks)
        self.can_queue_more = False
        if now_kiticks < self._next_refill_kiticks:
            return 0
        generator, ring = self.generator, self.ring
        until_kiticks = now_kiticks + self.lookahead_kiticks
        self._rates.last_until(now_kiticks + isr.kiticks_until(ring.timer, self._crossing, crossing.END))
        self.can_queue_more = generator.prepare(until_kiticks)
        turns = generator.at_reversal and (
            not self._crossing[crossing.LEFT] or generator.next_kiticks() <= until_kiticks
        )
        if not turns or self._tapped():
            self._merge(until_kiticks, turns)
            if self._crossing[crossing.LATE]:
                return codes.UNDERRUN
        ahead_kiticks = ring.fed_kiticks()
        if self._is_empty():
            if turns and not self._tapped():
                self._turn(ahead_kiticks)
                return 0
            if not self.can_queue_more and crossing.has_ended(self._crossing, until_kiticks):
                self._leave()
                self.can_queue_more = True
                return 0
        elif ahead_kiticks == NOT_FED:
            return self._restart_merged() if self._sampler.quiet() else 0
        if not self.can_queue_more:
            self._next_refill_kiticks = now_kiticks + _MERGED_KITICKS
        return codes.INTERNAL if NOT_FED < ahead_kiticks < _OVERDUE_KITICKS else 0

    def _is_empty(self) -> bool:
        """Whether all steps of the own queue were written to the ring."""
        queue = self._queue
        return queue[_STEPS] == 0 and queue[_IN] == queue[_OUT]

    def _tapped(self) -> bool:
        """Whether steps of the generator wait to be merged."""
        if self._crossing[crossing.NEXT] != self._crossing[crossing.COUNT]:
            return True
        return self.generator.waits()

    def _merge(self, until_kiticks: int, turns: bool) -> None:
        """Put steps into the own queue, up to a time, those of the play as far as the generator's are known.

        ``turns``: the joint is about to reverse.
        """
        words, queue, generator = self._crossing, self._queue, self.generator
        source = generator.queue
        extra_kiticks = until_kiticks
        if turns or self.can_queue_more or (source[_IN] - source[_OUT]) & _COUNT_MASK >= _FULL:
            extra_kiticks = min(source[_LATEST_KITICKS], until_kiticks)
        is_all = False  # what was tapped in an earlier call is not: the generator has put more into its queue since
        while True:
            if words[crossing.NEXT] == words[crossing.COUNT]:
                words[crossing.NEXT] = 0
                words[crossing.COUNT] = generator.write(self._tap, 0, _TAP_SPACE, self.ring.timer) >> 1
                is_all = words[crossing.COUNT] < _TAP_STEPS
            # more of the generator's may wait, and come before steps of the play that are after those tapped
            crossing.merge(
                words, self._tap_words, queue, extra_kiticks if is_all else until_kiticks - _PAST_KITICKS
            )
            if is_all or words[crossing.NEXT] != words[crossing.COUNT]:
                return

    def _turn(self, ahead_kiticks: int) -> None:
        """Reverse within a crossing, all of whose steps are in the ring."""
        if ahead_kiticks == NOT_FED:
            if not self._sampler.quiet():
                return
            self.ring.set_last_to_now()
        elif ahead_kiticks <= _GUARD_KITICKS:
            return
        self.can_queue_more = self._reverse()

    def _restart_merged(self) -> int:
        """Fill an empty ring from its start, from the own queue."""
        ring = self.ring
        if ring.written():
            self.empty()
        self._queue[_HEAD] = 0
        ring.state[_SPACE] = ring.entries - isr.SPARE_ENTRIES
        emit(_THIS_RING, ring.state, ring.timer)
        return codes.UNDERRUN if ring.run() else 0


def sides(drives: "list[JointDrive]") -> "list[tuple[int, int] | None]":
    """Of all joints, ``BacklashDrive.side``; None without backlash."""
    return [drive.side() if isinstance(drive, BacklashDrive) else None for drive in drives]


def take_sides(drives: "list[JointDrive]", found: "list[tuple[int, int] | None]") -> None:
    """Give the drives what ``sides`` found, as far as they have backlash."""
    for drive, side in zip(drives, found):
        if side and isinstance(drive, BacklashDrive):
            direction, left = side
            drive.take_side(direction, left)
