"""One joint's motion as a stream of step times: a step wherever the angle passes a half step.

A cell's first step is solved by itself, the others in blocks of two stretches between solved nodes, as long
as the error bound allows; its last one is held back until it is known not to be half of a graze.
"""

from array import array

from micropython import const

from armtempo_board.stepgen import bezier, braking, newton, step_queue, subdivision
from armtempo_board.stepgen.interval_steps import traverse
from armtempo_board.stepgen.newton import DELAY, HELD, A, solve
from armtempo_board.stepgen.step_queue import AT, HIGH, IN, LAST, MODE, emit, single, waiting
from armtempo_board.stepgen.subintervals import AT_START, END, NOT_YET, Subintervals

TYPE_CHECKING = False
if TYPE_CHECKING:
    from armtempo_shared.motion import Motion

_STRETCHES = const(2)  # times that something is prepared in one call at most,
_BUDGET = const(4)  # and parts looked at for each: bounds its time
_NODES = const(12)  # solved in one call
_BRAKING = const(1)  # in MODE
_AT_ONCE = const(2)
_CLEARED = (step_queue.STEPS, step_queue.LATEST_1024, AT, LAST, MODE, step_queue.HELD, step_queue.ENDED)
_FAR = const(1 << 16)  # 4096 ticks: longer than any cell and gap, and still a small integer in ticks


class Walker:
    """Walks one joint through a motion; every buffer is made once.

    Steps go into the queue of ``state`` (see step_queue.py). ``direction`` (1 or -1) is that of the steps put into the
    queue now. ``at_turn``: the next step goes the other way, ``turn`` lets it come. ``ended``: no more steps are
    put into the queue.
    """

    def __init__(self) -> None:
        self.subintervals = Subintervals()
        self._block = array("i", bytes(4 * newton.BLOCK_SIZE))
        self.state = array("i", bytes(4 * step_queue.STATE_SIZE))
        self.direction = self._heading = 1
        self.at_turn = False
        self.ended = True
        # every attribute from the start, so that none is added while a motion runs
        self._held = self._fresh = self._comes = self._released = False
        self._held_high = self._held_ticks = self._first_in = 0
        self._found = NOT_YET

    def load(
        self, motion: "Motion", joint: int, position_steps: int, pulse_ticks: int, gap_ticks: int
    ) -> None:
        """Stand at the start of a motion with the joint at ``position_steps``.

        ``pulse_ticks``: STEP high time; ``gap_ticks``: least time between steps in opposite directions. Two that
        would be closer are both left out.
        """
        self.subintervals.load(motion, joint)
        self.subintervals.reversal_ticks = gap_ticks >> 3
        state = self.state
        state[step_queue.PULSE] = pulse_ticks
        state[step_queue.OUT] = state[IN]
        state[step_queue.SLOW] = 4 * gap_ticks
        state[step_queue.SIZE] = 16
        for word in _CLEARED:
            state[word] = 0
        self._gap_ticks = gap_ticks
        self._position = position_steps + bezier.BIAS
        self.direction = 1
        self.at_turn = self.ended = False
        self._held = False  # the last step of a cell waits for what comes after it
        self._fresh = False  # the cell's first step is solved, but not in the queue
        self._released = False  # the last step in the queue was held back before
        self._found = NOT_YET  # what is known of the next part
        while not waiting(state) and not self.ended:
            if not self._prepare() and self.at_turn:
                self.turn()

    def prepare(self, until_1024: int) -> bool:
        """Put the next steps into the queue, unless it is full or goes on beyond a time (1024 ticks) already.

        What comes after that time is not written to the ring, and waits. True where it could go on: each call takes a
        limited time. At a turn it ends.
        """
        state = self.state
        state[step_queue.UNTIL_1024] = until_1024
        for _ in range(_STRETCHES):
            if not step_queue.wanted(state):
                return False
            if not self._prepare() and (self.at_turn or self.ended):
                return False
        return True

    def write(self, ring: array, mask: int, head: int, room: int) -> int:
        """Write up to ``room`` edge times (rise, fall, ...; ticks modulo 2**32) to ``ring`` from ``head`` on.

        ``ring``: array('I') of ``mask`` + 1 entries, ``head`` even. Returns how many were written.
        """
        state = self.state
        state[step_queue.HEAD] = head
        emit(room, ring, state, mask)
        return state[step_queue.HEAD] - head

    def latest_k(self) -> int:
        """Time of the last step in the queue, in 1024 ticks."""
        return self.state[step_queue.LATEST_1024]

    def waits(self) -> bool:
        """Whether steps wait in the queue."""
        return bool(waiting(self.state))

    def turn(self) -> None:
        """Let the steps in the other direction come."""
        self.direction = -self.direction
        self.at_turn = False

    def brake(self, start_ticks: int, length_ticks: int) -> None:
        """Come to rest along the path from a time on (see braking.py); nothing may be written meanwhile.

        It must not lie before any ``until_1024`` that ``prepare`` was given. Only what was put into the queue last goes
        on beyond that: steps of one cell, or one that was held back.
        """
        braking.set_law(self._block, start_ticks, length_ticks)
        start_k = start_ticks >> 10
        state = self.state
        state[MODE] |= _BRAKING
        at = state[AT]
        if state[step_queue.LATEST_1024] >= start_k and waiting(state):
            if self._released:
                step_queue.withdraw(state, state[IN] - 1 & 0xFFFF, start_k)
                self._held = True
            else:
                at -= step_queue.withdraw(state, self._first_in, start_k)
                if self._held:
                    self._held = False
                    at -= 1
        if self._held:
            self._brake_held()
        if at < 0:
            at = 0
            self._fresh = True
        state[AT] = at
        if self._fresh or at < state[LAST]:
            self._comes = self._solve(at)

    def _brake_held(self) -> None:
        block = self._block
        block[HELD] = self._held_ticks
        self._held = bool(braking.slow(block, HELD, self._held_high, 0))
        self._held_ticks = block[HELD] + block[HELD + DELAY]

    def next_1024(self) -> int:
        """Time of the next step to be written, or one before it while it is not known; in 1024 ticks."""
        time = step_queue.upcoming(self.state)
        if time != -1:
            return time
        if self._held:
            return _in_1024(self._held_high, self._held_ticks)
        if self._fresh:
            return _in_1024(self.state[HIGH], self._ticks())
        return _in_1024(self.state[HIGH] if self._within() else self.subintervals.time[0], 0)

    def _prepare(self) -> bool:
        """Put the next steps into the queue. False: at a turn, at the end, or not found yet."""
        given = self.state[IN]
        for _ in range(_BUDGET):
            if self.at_turn or self.ended:
                return False
            if self._fresh:
                self._first()
            elif self._within():
                self._go_on()
            else:
                self._next_cell()
            if self.state[IN] != given:
                return True
        return False

    def _next_cell(self) -> None:
        walk = self.subintervals
        if self._found == NOT_YET:
            self._found = walk.search(self._position)
        found = self._found
        if found == END or (self.state[MODE] & _BRAKING and braking.passed(self._block, walk.time[0])):
            if self._held:
                self._release()
            else:
                self.ended = True
        elif self._held and self._since_held(walk.time[0], walk.time[6] >> 16) > self._gap_ticks:
            self._release()
        elif found != NOT_YET:
            self._found = NOT_YET
            self._open(found == AT_START)

    def _open(self, at_once: bool) -> None:
        """Take up the steps of the cell that was found, and solve the first."""
        walk = self.subintervals
        block = self._block
        steps = walk.end() - self._position
        heading = 1 if steps > 0 else -1
        state = self.state
        scale = walk.time_local[subdivision.SCALE] - 12
        state[step_queue.TIME_SCALE] = scale
        state[HIGH] = walk.time[0]
        block[newton.OFFSET] = walk.time[6] >> (16 - scale)
        if at_once:
            block[newton.RANGE] = 0
        else:
            block[newton.TARGET] = 2 * (self._position - walk.angle[0]) + heading + bezier.BIAS
            newton.enter(block, walk.angle, walk.angle_local, walk.time_local)
        self._position += steps
        self._heading = heading
        state[LAST] = steps * heading - 1
        state[AT] = state[step_queue.SINGLY] = 0
        state[MODE] = state[MODE] & _BRAKING | (_AT_ONCE if at_once else 0)
        self._fresh = True
        self._first_in = state[IN]
        self._comes = self._solve(0)

    def _solve(self, index: int) -> bool:
        """Set node A to the cell's step ``index``; False where braking ends before it."""
        block = self._block
        state = self.state
        solve(block, index, 0)
        if not state[MODE] & _BRAKING:
            return True
        comes = braking.slow(block, A, state[HIGH], state[step_queue.TIME_SCALE])
        if comes and state[MODE] < _AT_ONCE:
            braking.steepen(block, A)
        return bool(comes)

    def _first(self) -> None:
        """The first step of a cell, against the one that was held back before it."""
        if self._held:
            opposite = self._heading != self.direction
            close = self._since_held(self.state[HIGH], self._ticks()) <= self._gap_ticks
            if opposite and close and self._comes:
                self._held = self._fresh = False  # a graze: neither comes
            else:
                self._release()
        elif not self._comes:
            self.ended = True
        elif self._heading != self.direction:
            self.at_turn = True
        else:
            self._fresh = False
            self._single()

    def _within(self) -> bool:
        """Whether the cell has more steps."""
        return self.state[AT] < self.state[LAST]

    def _go_on(self) -> None:
        """The next steps of the cell."""
        state = self.state
        self._released = False
        traverse(self._block, state, _NODES)
        if state[step_queue.HELD]:
            state[step_queue.HELD] = 0
            self._hold()
        if state[step_queue.ENDED]:
            self.ended = True

    def _single(self) -> None:
        """Queue the step at node A, or hold it back."""
        if self.state[LAST] == 0 and self._slowly():
            self._hold()
        else:
            self._released = False
            single(self.state, self.state[HIGH], self._ticks())

    def _hold(self) -> None:
        """Hold back the step at node A."""
        self._held = True
        self._held_high = self.state[HIGH]
        self._held_ticks = self._ticks()

    def _slowly(self) -> bool:
        """Whether the step at node A may be half of a graze.

        Acceleration near standstill is at most 0.16 steps / gap**2 (see check.py), so a joint that takes less than
        12 gaps for a step is not back within a gap; held against 4 of them.
        """
        ticks = self._block[A + newton.MANTISSA] >> self._block[A + newton.EXPONENT]
        return self.state[MODE] > 1 or ticks > self.state[step_queue.SLOW]

    def _release(self) -> None:
        self._held = False
        self._released = True
        single(self.state, self._held_high, self._held_ticks)
        self._first_in = self.state[IN]

    def _since_held(self, high: int, ticks: int) -> int:
        """Ticks from the step held back to a time; any large number where it is far."""
        high -= self._held_high
        if high > _FAR:
            high = _FAR
        return (high << 12) + ticks - self._held_ticks

    def _ticks(self) -> int:
        """Time of node A in ticks from the high word of the part on."""
        scale = self.state[step_queue.TIME_SCALE]
        ticks = (self._block[A] + (1 << (scale - 1))) >> scale
        return ticks + self._block[A + DELAY] if self.state[MODE] & _BRAKING else ticks


def _in_1024(high: int, ticks: int) -> int:
    return ((high - bezier.BIAS) << 2) + (ticks >> 10)
