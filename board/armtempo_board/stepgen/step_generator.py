"""One joint's motion as a stream of step times: a step wherever the angle passes a half step.

A monotone subinterval's first step is solved by itself, the others as two cubics at a time between solved nodes, as
long as the error bound allows it. Its last step is held back until it is known not to be followed by an opposite one.
What steps come is found in the motion's own time, so it is the same however slowly that runs (time_law.py).
"""

from micropython import const

from armtempo_board.memory import Memory
from armtempo_board.stepgen import newton, step_queue, subdivision
from armtempo_board.stepgen.bezier import BIAS, HIGH, LOW
from armtempo_board.stepgen.newton import (
    FIRST_NODE,
    HELD_NODE,
    NODE_DELAY,
    NODE_EXPONENT,
    NODE_MANTISSA,
    solve,
)
from armtempo_board.stepgen.step_queue import (
    AT_START,
    BY_LAW,
    HALTED,
    HELD_BACK,
    IN,
    INTERVAL_HIGH,
    LAST_STEP,
    LATEST_KITICKS,
    MODE,
    REACHED,
    SINGLE_STEPS,
    STEPS,
    TIME_SCALE,
    emit,
    holds_steps,
    put_single,
)
from armtempo_board.stepgen.subdivision import END, NOT_YET, SCALE
from armtempo_board.stepgen.subintervals import Subintervals

TYPE_CHECKING = False
if TYPE_CHECKING:
    from array import array
    from typing import Any

    from armtempo_shared.motion import MotionHead

_ITEMS_PER_CALL = const(2)  # put into the queue by one call of ``prepare`` at most,
_SEARCHES = const(4)  # and so many times a part of the motion looked at for each: bounds its time
_NODES = const(12)  # solved in one call
_CLEARED = (STEPS, LATEST_KITICKS, REACHED, LAST_STEP, MODE, HELD_BACK, HALTED)
_FIRST_CUBIC_STEPS = const(16)  # tried first in a motion
_LAW_WORDS = const(18)  # as in time_law.py
_FAR = const(1 << 16)  # in 4096 ticks: longer than any subinterval and gap, and a small integer in ticks


class StepGenerator:
    """Goes through one joint's motion.

    Steps go into ``queue`` (step_queue.py). ``direction`` (1 or -1) is that of the steps put in now. ``at_turn``: the
    next step goes the other way, ``turn`` lets it come. ``halted``: the motion's time will stand still, and the next
    step comes in another ``follow`` law. ``ended``: no more steps are put in. Between motions ``subintervals`` is free
    for the check of the next.
    """

    def __init__(self, memory: Memory) -> None:
        """``memory``: where its words are taken from (``armtempo_shared.engine_memory`` counts them)."""
        self.subintervals = Subintervals(memory)
        self._solver = memory.take_for_processor(newton.SOLVER_SIZE)
        self._law_words = memory.take_for_processor(_LAW_WORDS)
        self.queue = memory.take_for_processor(step_queue.QUEUE_SIZE)
        self._law: "Any" = None  # JointLaw, while a motion is loaded
        self.direction = self._heading = 1
        self.at_turn = False
        self.ended = True
        self.halted = self._is_last_law = False
        # every attribute from the start, so that none is added while a motion runs
        self._held = False  # the last step of a subinterval is held back
        self._first_waits = False  # the subinterval's first step is solved, but not in the queue,
        self._first_comes = False  # and by the law it comes
        self._first_ticks = 0  # its time in the motion's own
        self._held_queued = False  # the last step in the queue was held back before
        self._held_high = self._held_ticks = 0  # its time in the motion's own
        self._interval_in = 0
        self._found = NOT_YET  # what is known of the next subinterval

    def load(
        self, motion: "MotionHead", joint: int, position_steps: int, pulse_ticks: int, gap_ticks: int
    ) -> None:
        """Stand at the start of a motion with the joint at ``position_steps``.

        ``pulse_ticks``: STEP high time; ``gap_ticks``: least time between steps in opposite directions. Two that
        would be closer are both left out.
        """
        from armtempo_board.stepgen.override import JointLaw  # here, so that it can be forgotten

        self._law = JointLaw(self._law_words)
        self.subintervals.load(motion, joint)
        self.subintervals.min_ticks = gap_ticks >> 3
        queue = self.queue
        queue[step_queue.PULSE] = pulse_ticks
        queue[step_queue.OUT] = queue[IN]
        queue[step_queue.SLOW_TICKS] = 4 * gap_ticks
        queue[step_queue.CUBIC_STEPS] = _FIRST_CUBIC_STEPS
        for word in _CLEARED:
            queue[word] = 0
        queue[INTERVAL_HIGH] = BIAS
        self._gap_ticks = gap_ticks
        self._position = position_steps + BIAS
        self.direction = 1
        self.at_turn = self.ended = self.halted = self._is_last_law = False
        self._held = self._first_waits = self._held_queued = False
        self._found = NOT_YET
        while not holds_steps(queue) and not self.ended:
            if not self._prepare() and self.at_turn:
                self.turn()

    def close(self) -> None:
        """The motion is read no further; what only a motion needs is let go."""
        self.subintervals.close()
        self._law = None

    def prepare(self, until_kiticks: int) -> bool:
        """Put the next steps into the queue, unless it is full or goes on beyond a time already.

        What comes after that time is not written to the ring, and waits. True where it could go on: each call takes a
        limited time. At a turn it ends.
        """
        queue = self.queue
        queue[step_queue.UNTIL_KITICKS] = until_kiticks
        for _ in range(_ITEMS_PER_CALL):
            if not step_queue.has_room(queue):
                return False
            if not self._prepare() and (self.at_turn or self.halted or self.ended):
                return False
        return True

    def write(self, ring: "array[int] | memoryview[int]", mask: int, head: int, room: int) -> int:
        """Write up to ``room`` edge times (rise, fall, ...; ticks modulo 2**32) to ``ring`` from ``head`` on.

        ``ring``: array('I') of ``mask`` + 1 entries, ``head`` even. Returns how many were written.
        """
        queue = self.queue
        queue[step_queue.HEAD] = head
        emit(room, ring, queue, mask)
        return int(queue[step_queue.HEAD] - head)

    def latest_kiticks(self) -> int:
        """Time of the last step in the queue."""
        return int(self.queue[LATEST_KITICKS])

    def waits(self) -> bool:
        """Whether steps wait in the queue."""
        return bool(holds_steps(self.queue))

    def turn(self) -> None:
        """Let the steps in the other direction come."""
        self.direction = -self.direction
        self.at_turn = False

    def follow(self, law: "array[int]", is_last: bool) -> None:
        """Take the motion's time by a law from the real time on at which its ramp begins (time_law.py).

        Nothing may be written meanwhile. That time must not lie before any ``until_kiticks`` that ``prepare`` was
        given. Only what was put into the queue last goes on beyond that: steps of one subinterval, or one that was held
        back. The ramp of the law before must lie behind what was written. ``is_last``: where the motion's time stands
        still behind the ramp, it is the end.
        """
        queue = self.queue
        high = self._high()
        queue[MODE] |= BY_LAW
        queue[INTERVAL_HIGH] = self._law.take(law, high)
        start_kiticks = _kiticks(self._law.start_high(), 0)
        reached = queue[REACHED]
        if queue[LATEST_KITICKS] >= start_kiticks and holds_steps(queue):
            if self._held_queued:
                step_queue.withdraw(queue, queue[IN] - 1 & 0xFFFF, start_kiticks)
                self._held = True
            else:
                reached -= step_queue.withdraw(queue, self._interval_in, start_kiticks)
                if self._held:
                    self._held = False
                    reached -= 1
        if reached < 0:
            reached = 0
            self._first_waits = True
        queue[REACHED] = reached
        # what was written last may have followed the law before, so no cubic begins there
        queue[SINGLE_STEPS] = max(queue[SINGLE_STEPS], 1)
        if self._first_waits or reached < queue[LAST_STEP]:
            self._solve(reached)
        self.halted = False
        self.finish(is_last)

    def finish(self, is_last: bool = True) -> None:
        """Whether the motion is at its end where by the law its time stands still."""
        self._is_last_law = is_last
        if is_last and self.halted:
            self.ended = True

    def next_kiticks(self) -> int:
        """Time of the next step to be written, or one before it while it is not known."""
        time = step_queue.next_kiticks(self.queue)
        if time != -1:
            return time
        if self._held:
            return _kiticks(self._held_high, self._held_ticks)
        if self._first_waits:
            return _kiticks(self.queue[INTERVAL_HIGH], self._ticks())
        return _kiticks(self.queue[INTERVAL_HIGH] if self._has_more() else self.subintervals.time[HIGH], 0)

    def _prepare(self) -> bool:
        """Put the next steps into the queue. False: at a turn, at the end, or not found yet."""
        before = self.queue[IN]
        for _ in range(_SEARCHES):
            if self.at_turn or self.halted or self.ended:
                return False
            if self._first_waits:
                self._queue_first()
            elif self._has_more():
                self._queue_more()
            else:
                self._next_interval()
            if self.queue[IN] != before:
                return True
        return False

    def _next_interval(self) -> None:
        now = self.subintervals
        if self._found == NOT_YET:
            self._found = now.search(self._position)
        found = self._found
        is_past = self.queue[MODE] & BY_LAW and self._law.is_past(now.time[HIGH])
        if found == END or is_past:
            if self._held:
                self._queue_held()
            elif found == END:
                self.ended = True
            else:
                self._halt()
        elif self._held and self._since_held(now.time[HIGH], now.time[LOW] >> 16) > self._gap_ticks:
            self._queue_held()
        elif found != NOT_YET:
            self._found = NOT_YET
            self._begin_interval(found == subdivision.AT_START)

    def _begin_interval(self, at_start: bool) -> None:
        """Take up the steps of the subinterval that was found, and solve the first."""
        now = self.subintervals
        solver = self._solver
        steps = now.end() - self._position
        heading = 1 if steps > 0 else -1
        queue = self.queue
        scale = now.time_measures[SCALE] - 12
        queue[TIME_SCALE] = scale
        queue[INTERVAL_HIGH] = now.time[HIGH]
        if queue[MODE] & BY_LAW:
            queue[INTERVAL_HIGH] = self._law.count_from(now.time[HIGH])
        solver[newton.TIME_OFFSET] = now.time[LOW] >> (16 - scale)
        if at_start:
            solver[newton.RANGE] = 0
        else:
            solver[newton.TARGET] = 2 * (self._position - now.angle[HIGH]) + heading + BIAS
            newton.set_interval(solver, now.angle, now.angle_measures, now.time_measures)
        self._position += steps
        self._heading = heading
        queue[LAST_STEP] = steps * heading - 1
        queue[REACHED] = queue[SINGLE_STEPS] = 0
        queue[MODE] = queue[MODE] & BY_LAW | (AT_START if at_start else 0)
        self._first_waits = True
        self._interval_in = queue[IN]
        self._solve(0)

    def _solve(self, index: int) -> None:
        """Set the first node to the subinterval's step ``index``."""
        solver = self._solver
        queue = self.queue
        solve(solver, index, 0)
        self._first_ticks = self._node_ticks()
        self._first_comes = True
        if queue[MODE] & BY_LAW:
            comes = self._law.to_real_time(solver, FIRST_NODE, queue[TIME_SCALE])
            if comes and queue[MODE] < AT_START:
                self._law.scale_slope(solver, FIRST_NODE)
            self._first_comes = comes

    def _queue_first(self) -> None:
        """The first step of a subinterval, against the one that was held back before it."""
        if self._held:
            is_opposite = self._heading != self.direction
            if is_opposite and self._since_held(self._high(), self._first_ticks) <= self._gap_ticks:
                self._held = self._first_waits = False  # neither comes
            else:
                self._queue_held()
        elif not self._first_comes:
            self._halt()
        elif self._heading != self.direction:
            self.at_turn = True
        else:
            self._first_waits = False
            self._queue_single()

    def _has_more(self) -> bool:
        """Whether the subinterval has more steps."""
        return self.queue[REACHED] < self.queue[LAST_STEP]

    def _queue_more(self) -> None:
        """The next steps of the subinterval."""
        queue = self.queue
        self._held_queued = False
        self._law.queue_steps(self._solver, queue, _NODES)
        if queue[HELD_BACK]:
            queue[HELD_BACK] = 0
            if queue[MODE] & BY_LAW:  # its node is in real time
                solve(self._solver, queue[LAST_STEP], 0)
            self._first_ticks = self._node_ticks()
            self._hold_back()
        if queue[HALTED]:
            queue[HALTED] = 0
            self._halt()

    def _halt(self) -> None:
        """By the law nothing comes any more: the end, or until another law."""
        self.halted = True
        self.finish(self._is_last_law)

    def _queue_single(self) -> None:
        """Queue the step at the first node, or hold it back."""
        if self.queue[LAST_STEP] == 0 and self._is_slow():
            self._hold_back()
        else:
            self._held_queued = False
            put_single(self.queue, self.queue[INTERVAL_HIGH], self._ticks())

    def _hold_back(self) -> None:
        """Hold back the step at the first node."""
        self._held = True
        self._held_high = self._high()
        self._held_ticks = self._first_ticks

    def _is_slow(self) -> bool:
        """Whether the step at the first node may be followed by an opposite one within the gap.

        Acceleration near standstill is at most 0.16 steps / gap**2 (see motion_check.py), so a joint that takes less
        than 12 gaps for a step is not back within a gap; held against 4 of them.
        """
        ticks = self._solver[FIRST_NODE + NODE_MANTISSA] >> self._solver[FIRST_NODE + NODE_EXPONENT]
        return self.queue[MODE] >= AT_START or ticks > self.queue[step_queue.SLOW_TICKS]

    def _queue_held(self) -> None:
        """Queue the step that was held back, if by the law it comes."""
        high, ticks = self._held_high, self._held_ticks
        if self.queue[MODE] & BY_LAW:
            solver, law = self._solver, self._law
            before = law.motion_high()
            high = law.count_from(high)
            solver[HELD_NODE] = ticks
            comes = law.to_real_time(solver, HELD_NODE, 0)
            ticks = solver[HELD_NODE] + solver[HELD_NODE + NODE_DELAY]
            law.count_from(before)
            if not comes:
                self._halt()
                return
        self._held = False
        self._held_queued = True
        put_single(self.queue, high, ticks)
        self._interval_in = self.queue[IN]

    def _since_held(self, high: int, ticks: int) -> int:
        """Ticks of the motion's time from the step held back to another; any large number where it is far."""
        high -= self._held_high
        if high > _FAR:
            high = _FAR
        return (high << 12) + ticks - self._held_ticks

    def _high(self) -> int:
        """What the motion's times of the subinterval count from."""
        return int(self._law.motion_high() if self.queue[MODE] & BY_LAW else self.queue[INTERVAL_HIGH])

    def _node_ticks(self) -> int:
        """Time of the first node in ticks, rounded."""
        scale = self.queue[TIME_SCALE]
        return (self._solver[FIRST_NODE] + (1 << (scale - 1))) >> scale

    def _ticks(self) -> int:
        """Real time of the first node in ticks from INTERVAL_HIGH on."""
        ticks = self._node_ticks()
        return ticks + self._solver[FIRST_NODE + NODE_DELAY] if self.queue[MODE] & BY_LAW else ticks


def _kiticks(high: int, ticks: int) -> int:
    return ((high - BIAS) << 2) + (ticks >> 10)
