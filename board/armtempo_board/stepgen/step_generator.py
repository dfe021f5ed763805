"""One joint's motion as a stream of step times: a step wherever the angle passes a half step.

A monotone subinterval's first step is solved by itself, the others as two cubics at a time between solved nodes, as
long as the error bound allows it. Its last step is held back until it is known not to be followed by an opposite one.
What steps come is found in the motion's own time, so it is the same however slowly that runs (time_law.py).

What is solved but not in the queue is ``_pending``: NOTHING, the LAST step of the subinterval before, the FIRST of this
one, or BOTH::

              a subinterval begins           a subinterval begins
      NOTHING ───────────────────▶ FIRST    LAST ───────────────▶ BOTH
       ▲ ▲ ▲ │                      │ │     ▲ ▲ │                  │ │
       │ │ │ └─ its last step is slow ──────┘ │ │                  │ └─ LAST is queued ─▶ FIRST
       │ │ └───── is queued ────────┘ └───────┘ │                  │
       │ │                  is slow, and alone  │                  │
       │ └─ is queued: what follows is far away ┘                  │
       └─── neither comes: they are opposite and within the gap ───┘

A first step that others follow in the direction of those before is queued as its subinterval begins. ``follow`` takes
steps back out of the queue, to LAST or FIRST.
"""

from array import array

from micropython import const

from armtempo_board.memory import Memory
from armtempo_board.stepgen import newton, step_queue
from armtempo_board.stepgen.newton import solve
from armtempo_board.stepgen.override import JointLaw
from armtempo_board.stepgen.step_queue import emit, has_space, put_single
from armtempo_board.stepgen.subintervals import Subintervals

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from armtempo_shared.motion import MotionHead

_PARTS_PER_CALL = const(2)  # of the motion that one call of ``prepare`` looks at: bounds its time
# as in step_queue.py: words of the queue
_STEPS = const(11)
_TIME_SCALE = const(14)
_PULSE = const(17)
_HEAD = const(18)
_IN = const(20)
_OUT = const(21)
_LATEST_KITICKS = const(22)
_REACHED = const(23)
_LAST_STEP = const(24)
_CUBIC_STEPS = const(25)
_SLOW_TICKS = const(26)
_INTERVAL_HIGH = const(27)
_MODE = const(28)
_SINGLE_STEPS = const(29)
_HELD_BACK = const(30)
_HALTED = const(31)
# of MODE
_BY_LAW = const(1)
_AT_START = const(2)
# as in newton.py: words of the solver
_FIRST_NODE = const(28)
_HELD_NODE = const(43)
# of a node
_NODE_MANTISSA = const(1)
_NODE_EXPONENT = const(2)
_NODE_DELAY = const(3)
# as in bezier.py: words of a piece
_HIGH = const(0)
_LOW = const(6)
_BIAS = const(1 << 28)
# as in time_law.py: words of the law
_REAL_START_HIGH = const(4)
_MOTION_HIGH = const(22)
# what was found, as subdivision.py says it
_NOT_YET = const(0)
_FOUND_AT_START = const(2)
_END = const(3)
# as in interval_steps.py: results, 0 if the queue has no space
_STOPPED = const(2)

# as in isr.py: word of a ring's state
_SPACE = const(8)
_NO_RING = array("i", bytes(4 * 9))  # the state of one that no interrupt writes to

# of ``_pending``
_NOTHING = const(0)
_LAST = const(1)
_FIRST = const(2)
_BOTH = const(3)
_THIS_RING = const(1)  # bit of the first one at hand
_CLEARED = (_STEPS, _REACHED, _LAST_STEP, _MODE, _HELD_BACK, _HALTED)
_FIRST_CUBIC_STEPS = const(16)  # tried first in a motion
_LAW_WORDS = const(27)  # as in time_law.py
_BEFORE = const(-1)  # in Ki ticks: before a motion
_LARGEST = const(1 << 16)  # in 4096 ticks: longer than any subinterval and gap, and a small integer in ticks


class StepGenerator:
    """Goes through one joint's motion.

    Steps go into ``queue`` (step_queue.py). ``direction`` (1 or -1) is that of the steps put in now. ``at_reversal``:
    the next step goes the other way, ``reverse`` lets it come. ``halted``: the motion's time will stand still, and the
    next step comes in another ``follow`` law. ``ended``: no more steps are put in. Between motions ``subintervals`` is
    free for the check of the next.
    """

    def __init__(self, memory: Memory) -> None:
        """``memory``: where its words are taken from (``armtempo_shared.engine_memory`` counts them)."""
        self.queue = memory.take_for_processor(step_queue.QUEUE_SIZE)  # the largest first: less is lost
        self.subintervals = Subintervals(memory)
        self._solver = memory.take_for_processor(newton.SOLVER_SIZE)
        self._law_words = memory.take_for_processor(_LAW_WORDS)
        self._law: "Any" = None  # JointLaw, while a motion is loaded
        self.direction = 1
        self.at_reversal = False
        self.ended = True
        self.halted = self._is_last_law = False
        # every attribute from the start, so that none is added while a motion runs
        self._pending = _NOTHING
        self._first_direction = 1  # of FIRST,
        self._first_ticks = 0  # its time in the motion's own,
        self._first_due = False  # and whether it occurs by the law
        self._last_high = self._last_ticks = 0  # the time of LAST in the motion's own
        self._last_is_queued = False  # nothing was queued since LAST was
        self._interval_in = 0  # IN of the queue as the subinterval began
        self._found = _NOT_YET  # what is known of the next subinterval

    def load(
        self,
        motion: "MotionHead",
        joint: int,
        position_steps: int,
        pulse_ticks: int,
        gap_ticks: int,
        moves: int = 1,
    ) -> None:
        """Stand at the first step of a motion; as ``begin``.

        ``moves``: 0 if the joint is known to stand, all its control points being equal. If it stands at its position,
        no step is looked for, which would take as long as the check of a joint.
        """
        self.begin(motion, joint, position_steps, pulse_ticks, gap_ticks)
        self.ended = not moves and self.subintervals.end_steps() == position_steps
        while self.seek():
            pass

    def begin(
        self, motion: "MotionHead", joint: int, position_steps: int, pulse_ticks: int, gap_ticks: int
    ) -> None:
        """Stand at the start of a motion with the joint at ``position_steps``.

        ``pulse_ticks``: STEP high time; ``gap_ticks``: least time between steps in opposite directions. Two that
        would be closer are both left out.
        """
        self._law = JointLaw(self._law_words)
        self.subintervals.load(motion, joint)
        self.subintervals.min_ticks = gap_ticks >> 3
        queue = self.queue
        queue[_PULSE] = pulse_ticks
        queue[_OUT] = queue[_IN]
        queue[_SLOW_TICKS] = 4 * gap_ticks
        queue[_CUBIC_STEPS] = _FIRST_CUBIC_STEPS
        for word in _CLEARED:
            queue[word] = 0
        queue[_LATEST_KITICKS] = _BEFORE
        queue[_INTERVAL_HIGH] = _BIAS
        self._gap_ticks = gap_ticks
        self._position = position_steps + _BIAS
        self.direction = 1
        self.at_reversal = self.ended = self.halted = self._is_last_law = False
        self._pending = _NOTHING
        self._last_is_queued = False
        self._found = _NOT_YET

    def seek(self) -> bool:
        """Continue from the start towards the first step, for a limited time; False if it waits, or there is none."""
        if self.ended or self.waits():
            return False
        if self.at_reversal:
            self.reverse()
        # A step that comes at 0 is the last one, too: a law that begins there takes it back
        self.prepare(_BEFORE)
        return True

    def close(self) -> None:
        """The motion is read no further; what only a motion needs is released."""
        self.subintervals.close()
        self._law = None

    def prepare(self, until_kiticks: int) -> bool:
        """Put the next steps into the queue, unless it is full or continues beyond a time already.

        What comes after that time is not written to the ring, and waits. True if it could continue: each call takes a
        limited time. At a reversal it ends.
        """
        queue = self.queue
        for _ in range(_PARTS_PER_CALL):
            if not has_space(queue, until_kiticks) or self.at_reversal or self.halted or self.ended:
                return False
            if self._pending & _FIRST:
                self._queue_first()
            elif queue[_REACHED] < queue[_LAST_STEP]:
                result = self._law.queue_steps(self._solver, queue, self._law_words)
                if not result:
                    return False
                if result == _STOPPED:
                    self._end_interval()
            else:
                self._next_interval()
        return True

    def write(self, ring: "array[int] | memoryview[int]", head: int, space: int, timer: "Any") -> int:
        """Write up to ``space`` edge times (rise, fall, ...; ticks modulo 2**32) to a ring, from the entry ``head`` on.

        ``ring``: the ring's state (isr.py), which says where it and the queue are. ``head`` is even. ``timer``: see
        ``emit``. Returns how many were written.
        """
        queue = self.queue
        queue[_HEAD] = head
        ring[_SPACE] = space
        emit(_THIS_RING, ring, timer)
        return int(queue[_HEAD] - head)

    def latest_kiticks(self) -> int:
        """Time of the last step in the queue."""
        latest_kiticks: int = self.queue[_LATEST_KITICKS]
        return latest_kiticks

    def waits(self) -> bool:
        """Whether steps wait in the queue."""
        queue = self.queue
        return queue[_STEPS] != 0 or queue[_IN] != queue[_OUT]

    def reverse(self) -> None:
        """Let the steps in the other direction come."""
        self.direction = -self.direction
        self.at_reversal = False

    def follow(
        self, law: "array[int]", is_last: bool, ring: "array[int] | memoryview[int]" = _NO_RING
    ) -> None:
        """Take the motion's time by a law from the real time on at which its ramp begins (time_law.py).

        That time must not lie before any ``until_kiticks`` that ``prepare`` was given. Only what was put into the
        queue last lies beyond that: steps of one subinterval, or one that was held back. The ramp of the law before
        must be after what was written. ``is_last``: if the motion's time stands still after the ramp, it is the end.
        ``ring``: the state (isr.py) of the one that an interrupt may write to meanwhile.
        """
        queue = self.queue
        high = self._high()
        queue[_MODE] |= _BY_LAW
        queue[_INTERVAL_HIGH] = self._law.take(law, high)
        start_kiticks = _kiticks(self._law_words[_REAL_START_HIGH], 0)
        reached = queue[_REACHED]
        if queue[_LATEST_KITICKS] >= start_kiticks and self.waits():
            first = queue[_IN] - 1 & 0xFFFF if self._last_is_queued else self._interval_in
            steps = step_queue.withdraw(queue, first, start_kiticks, ring)
            if self._last_is_queued:
                self._pending |= _LAST
            else:
                reached -= steps
                if self._pending == _LAST:
                    self._pending = _NOTHING
                    reached -= 1
        if reached < 0:
            reached = 0
            self._pending = _FIRST
            self._first_direction = self.direction  # it was in the queue, or is LAST after what was
        queue[_REACHED] = reached
        # what was written last may have followed the law before, so no cubic begins there
        queue[_SINGLE_STEPS] = max(queue[_SINGLE_STEPS], 1)
        if self._pending & _FIRST or reached < queue[_LAST_STEP]:
            self._solve(reached)
        self.halted = False
        self.finish(is_last)

    def finish(self, is_last: bool = True) -> None:
        """Whether the motion is at its end where by the law its time stands still."""
        self._is_last_law = is_last
        if is_last and self.halted:
            self.ended = True

    def end_steps(self, at_rest: bool) -> int:
        """Position at which the joint must stand once it has ended: where the record ends, or a last law stopped it.

        ``at_rest``: the motion's time stands still, and it ends here.
        """
        if not (self._is_last_law or at_rest):
            return self.subintervals.end_steps()
        queue = self.queue
        left = self.direction * (queue[_LAST_STEP] - queue[_REACHED])
        if self._pending & _FIRST:
            left = self._first_direction * (queue[_LAST_STEP] + 1)
        if self._pending & _LAST:
            left += self.direction
        return self._position - _BIAS - left

    def next_kiticks(self) -> int:
        """Time of the next step to be written, or one before it while it is not known."""
        time = step_queue.next_kiticks(self.queue)
        if time != -1:
            return time
        if self._pending & _LAST:
            return _kiticks(self._last_high, self._last_ticks)
        if self._pending:
            return _kiticks(self.queue[_INTERVAL_HIGH], self._ticks())
        has_more = self.queue[_REACHED] < self.queue[_LAST_STEP]
        return _kiticks(self.queue[_INTERVAL_HIGH] if has_more else self.subintervals.time[_HIGH], 0)

    def _next_interval(self) -> None:
        found = self._found or self.subintervals.search(self._position)
        if self._pending or self.queue[_MODE] & _BY_LAW:
            self._found = found
            if self._waits_for(found):
                return
        if found == _END:
            self.ended = True
        elif found:
            self._found = _NOT_YET
            self._begin_interval(found)

    def _waits_for(self, found: int) -> bool:
        """Whether something else is done, as LAST is pending or by the law the motion's time stands still."""
        now = self.subintervals
        if found == _END or (self.queue[_MODE] & _BY_LAW and self._law.is_past(now.time[_HIGH])):
            if self._pending:
                self._queue_last()
            elif found == _END:
                return False
            else:
                self._halt()
        elif self._pending and self._since_last(now.time[_HIGH], now.time[_LOW] >> 16) > self._gap_ticks:
            self._queue_last()
        else:
            return False
        return True

    def _begin_interval(self, found: int) -> None:
        """Take up the steps of the subinterval that was found, and solve the first."""
        queue = self.queue
        now = self.subintervals
        by_law = queue[_MODE] & _BY_LAW
        if by_law:
            queue[_INTERVAL_HIGH] = self._law.count_from(now.time[_HIGH])
        self._interval_in = queue[_IN]
        direction = 0 if self._pending else self.direction
        at_start = found == _FOUND_AT_START
        steps = self._law.begin(self._solver, queue, now.arrays, self._position, at_start, direction)
        self._position += steps >> 1
        if steps & 1:
            self._last_is_queued = False
            return
        self._first_direction = 1 if steps > 0 else -1
        self._pending |= _FIRST
        if by_law:
            self._solve(0)
        else:
            self._first_ticks = self._node_ticks()
            self._first_due = True

    def _solve(self, index: int) -> None:
        """Set the first node to the subinterval's step ``index``."""
        solver = self._solver
        queue = self.queue
        solve(solver, index, 0)
        self._first_ticks = self._node_ticks()
        self._first_due = True
        if queue[_MODE] & _BY_LAW:
            comes = self._law.to_real_time(self._law_words, solver, _FIRST_NODE, queue[_TIME_SCALE])
            if comes and queue[_MODE] < _AT_START:
                self._law.scale_slope(solver, _FIRST_NODE)
            self._first_due = comes

    def _queue_first(self) -> None:
        """Queue FIRST; with LAST pending too, decide both."""
        is_opposite = self._first_direction != self.direction
        if self._pending == _BOTH:
            if is_opposite and self._since_last(self._high(), self._first_ticks) <= self._gap_ticks:
                self._pending = _NOTHING  # neither comes
            else:
                self._queue_last()
        elif not self._first_due:
            self._halt()
        elif is_opposite:
            self.at_reversal = True
        else:
            self._pending = _NOTHING
            if self.queue[_LAST_STEP] == 0 and self._is_slow():
                self._hold_back()
            else:
                self._last_is_queued = False
                put_single(self.queue, self.queue[_INTERVAL_HIGH], self._ticks())

    def _end_interval(self) -> None:
        """``queue_steps`` came to the subinterval's last step, which is slow, or by the law to the last of all."""
        queue = self.queue
        if queue[_HELD_BACK]:
            queue[_HELD_BACK] = 0
            if queue[_MODE] & _BY_LAW:  # its node is in real time
                solve(self._solver, queue[_LAST_STEP], 0)
            self._first_ticks = self._node_ticks()
            self._hold_back()
        if queue[_HALTED]:
            queue[_HALTED] = 0
            self._halt()

    def _halt(self) -> None:
        """By the law nothing comes any more: the end, or until another law."""
        self.halted = True
        self.finish(self._is_last_law)

    def _hold_back(self) -> None:
        """The step at the first node is LAST."""
        self._pending = _LAST
        self._last_high = self._high()
        self._last_ticks = self._first_ticks

    def _is_slow(self) -> bool:
        """Whether the step at the first node may be followed by an opposite one within the gap.

        Acceleration near standstill is at most 0.16 steps / gap**2 (see motion_check.py), so a joint that takes less
        than 12 gaps for a step is not back within a gap; checked against 4 of them.
        """
        ticks = self._solver[_FIRST_NODE + _NODE_MANTISSA] >> self._solver[_FIRST_NODE + _NODE_EXPONENT]
        return self.queue[_MODE] >= _AT_START or ticks > self.queue[_SLOW_TICKS]

    def _queue_last(self) -> None:
        """Queue LAST, if by the law it comes."""
        high, ticks = self._last_high, self._last_ticks
        if self.queue[_MODE] & _BY_LAW:
            solver, law = self._solver, self._law
            before = self._law_words[_MOTION_HIGH]
            high = law.count_from(high)
            solver[_HELD_NODE] = ticks
            comes = law.to_real_time(self._law_words, solver, _HELD_NODE, 0)
            ticks = solver[_HELD_NODE] + solver[_HELD_NODE + _NODE_DELAY]
            law.count_from(before)
            if not comes:
                self._halt()
                return
        self._pending &= _FIRST
        self._last_is_queued = True
        put_single(self.queue, high, ticks)
        self._interval_in = self.queue[_IN]

    def _since_last(self, high: int, ticks: int) -> int:
        """Ticks of the motion's time from LAST to another step; any large number if it is far."""
        high -= self._last_high
        if high > _LARGEST:
            high = _LARGEST
        return (high << 12) + ticks - self._last_ticks

    def _high(self) -> int:
        """What the motion's times of the subinterval count from."""
        high: int = (
            self._law_words[_MOTION_HIGH] if self.queue[_MODE] & _BY_LAW else self.queue[_INTERVAL_HIGH]
        )
        return high

    def _node_ticks(self) -> int:
        """Time of the first node in ticks, rounded."""
        scale = self.queue[_TIME_SCALE]
        return (self._solver[_FIRST_NODE] + (1 << (scale - 1))) >> scale

    def _ticks(self) -> int:
        """Real time of the first node in ticks from INTERVAL_HIGH on."""
        if self.queue[_MODE] & _BY_LAW:
            return self._node_ticks() + self._solver[_FIRST_NODE + _NODE_DELAY]
        return self._first_ticks


def _kiticks(high: int, ticks: int) -> int:
    return ((high - _BIAS) << 2) + (ticks >> 10)
