"""One joint's motion as a stream of step times: a step wherever the angle passes a half step.

A cell's first step is solved by itself, the others in blocks of two stretches between solved nodes, as long
as the error bound allows; its last one is held back until it is known not to be half of a graze.
"""

from array import array

from micropython import const

from armtempo_board import braking, cell, cells, crossing, points, stretch
from armtempo_board.crossing import DELAY, HELD, A, B, solve
from armtempo_board.stretch import (
    BASE_HIGH,
    HEAD,
    NEXT_STEPS,
    ROOM,
    STEPS,
    UNTIL_1024,
    accept,
    differences,
    emit,
)

TYPE_CHECKING = False
if TYPE_CHECKING:
    from armtempo_shared.motion import Motion

    from armtempo_board.parts import Parts

_BUDGET = const(4)  # parts looked at in one call: bounds its time
_LARGEST = const(1024)  # steps of a stretch
# where the prepared steps come from: see ``brake``
_CELL = const(0)
_RELEASED = const(1)
_AHEAD = const(2)
_NODES = (A, crossing.MIDDLE, B)
_FAR = const(1 << 16)  # 4096 ticks: longer than any cell and gap, and still a small integer in ticks
_NEVER = const(1 << 28)  # 1024 ticks: 54 minutes


class Walker:
    """Walks one joint through a motion; every buffer is made once.

    ``direction`` (1 or -1) is that of the steps which ``fill`` writes now. ``at_turn``: the next step goes the
    other way, ``turn`` lets it come. ``ended``: no step is left.
    """

    def __init__(self) -> None:
        self._cells = cells.Cells()
        self._block = array("i", bytes(4 * crossing.BLOCK_SIZE))
        self._state = array("i", bytes(4 * stretch.STATE_SIZE))
        self.direction = self._heading = 1
        self.at_turn = False
        self.ended = True
        # every attribute from the start, so that none is added while a motion runs
        self._held = self._fresh = self._at_once = self._comes = self._braking = False
        self._held_high = self._held_ticks = self._at = self._last = self._high = 0
        self._found = cells.NOTHING
        self._origin = _CELL

    def load(
        self, motion: "Motion", joint: int, position_steps: int, pulse_ticks: int, gap_ticks: int
    ) -> None:
        """Stand at the start of a motion with the joint at ``position_steps``.

        ``pulse_ticks``: STEP high time; ``gap_ticks``: least time between steps in opposite directions. Two that
        would be closer are both left out.
        """
        self._cells.load(motion, joint)
        self._cells.graze_ticks = gap_ticks >> 3
        self._braking = False
        self._state[stretch.PULSE] = pulse_ticks
        self._state[STEPS] = self._state[NEXT_STEPS] = self._state[stretch.LAST_1024] = 0
        self._gap_ticks = gap_ticks
        self._position = position_steps + points.BIAS
        self.direction = 1
        self.at_turn = self.ended = False
        self._held = False  # the last step of a cell waits for what comes after it
        self._fresh = False  # the cell's first step is solved, but not written
        self._found = cells.NOTHING  # what is known of the next part
        self._at = self._last = 0  # node a's step in the cell; the cell's last one
        self._size = 16
        while not self._state[STEPS] and not self.ended:
            if not self._prepare() and self.at_turn:
                self.turn()

    def lend(self) -> "Parts":
        """The buffers of its parts, free until a motion is loaded."""
        return self._cells

    def fill(self, ring: array, mask: int, head: int, room: int, until_1024: int = _NEVER) -> int:
        """Write up to ``room`` edge times (rise, fall, ...; ticks modulo 2**32) to ``ring`` from ``head`` on.

        ``ring``: array('I') of ``mask`` + 1 entries, ``head`` even. Steps after ``until_1024`` (1024 ticks) wait for a
        later call, but for a few. Returns how many were written; 0: no room, none until then, at a turn,
        ended, or the search for the next step goes on with the next call.
        """
        state = self._state
        state[UNTIL_1024] = until_1024
        state[HEAD] = head
        state[ROOM] = room
        if emit(0, ring, state, mask):
            while self._prepare() and emit(0, ring, state, mask):
                pass
        elif self._at == self._last or not self._found:
            self._look_ahead(until_1024)
        return room - state[ROOM]

    def _look_ahead(self, until_1024: int) -> None:
        """While the ring is full: find the next cell, and take it up once the last steps before it are prepared.

        Only where nothing can come between: it goes on in the same direction, and begins before ``until_1024``.
        """
        walk = self._cells
        state = self._state
        if self._found == cells.NOTHING:
            self._found = walk.next(self._position)
        elif (
            self._found == cells.CELL
            and self._at == self._last
            and state[STEPS]
            and not (state[NEXT_STEPS] or self._held or self._fresh or self._braking)
            and (walk.end() - self._position) * self.direction > 1
            and _in_1024(walk.time[0], 0) < until_1024
        ):
            self._found = cells.NOTHING
            self._open(False)
            if self._fresh and self._last:
                self._fresh = False
                self._origin = _AHEAD
                stretch.single(state, stretch.NEXT, self._high, self._ticks())

    def turn(self) -> None:
        """Let the steps in the other direction come."""
        self.direction = -self.direction
        self.at_turn = False

    def brake(self, start_ticks: int, length_ticks: int) -> None:
        """Come to rest along the path from a time on (see braking.py).

        It must not lie before any ``until_1024`` that ``fill`` was given, nor before any step written.
        """
        braking.set_law(self._block, start_ticks, length_ticks)
        self._braking = True
        state = self._state
        unwritten = state[STEPS] + state[NEXT_STEPS]
        if self._origin == _AHEAD and state[NEXT_STEPS]:
            self._at = -1  # what is left of the cell before comes before braking
        else:
            state[STEPS] = 0
        state[NEXT_STEPS] = 0
        if unwritten and self._origin == _RELEASED:
            self._held = True
        elif unwritten and self._at >= 0:
            if self._held:
                self._held = False
                unwritten += 1
            self._at -= unwritten
        if self._held:
            self._brake_held()
        if self._at < 0:
            self._at = 0
            self._fresh = True
        if self._fresh or self._at < self._last:
            self._comes = self._solve(self._at)

    def _brake_held(self) -> None:
        block = self._block
        block[HELD] = self._held_ticks
        self._held = bool(braking.slow(block, HELD, self._held_high, 0))
        self._held_ticks = block[HELD] + block[HELD + DELAY]

    def last_1024(self) -> int:
        """Time of the step written last, in 1024 ticks."""
        return self._state[stretch.LAST_1024]

    def next_1024(self) -> int:
        """Time of the next step to be written, or one before it while it is not known; in 1024 ticks."""
        if self._state[STEPS]:
            return stretch.upcoming(self._state)
        if self._state[NEXT_STEPS]:
            return self._state[stretch.NEXT + stretch.BASE_1024]
        if self._held:
            return _in_1024(self._held_high, self._held_ticks)
        if self._fresh:
            return _in_1024(self._high, self._ticks())
        return _in_1024(self._high if self._at < self._last else self._cells.time[0], 0)

    def _prepare(self) -> bool:
        """Make the next stretch ready. False: at a turn, at the end, or not found yet."""
        if not self._fresh and self._at < self._last:
            return self._go_on()
        for _ in range(_BUDGET):
            if self.at_turn or self.ended:
                return False
            if self._fresh:
                self._first()
            elif self._at < self._last:
                return self._go_on()
            else:
                self._next_cell()
            if self._state[STEPS]:
                return True
        return False

    def _next_cell(self) -> None:
        walk = self._cells
        if self._found == cells.NOTHING:
            self._found = walk.next(self._position)
        found = self._found
        if found == cells.END or (self._braking and braking.passed(self._block, walk.time[0])):
            if self._held:
                self._release()
            else:
                self.ended = True
        elif self._held and self._since_held(walk.time[0], walk.time[6] >> 16) > self._gap_ticks:
            self._release()
        elif found != cells.NOTHING:
            self._found = cells.NOTHING
            self._open(found == cells.AT_ONCE)

    def _open(self, at_once: bool) -> None:
        """Take up the steps of the cell that was found, and solve the first."""
        walk = self._cells
        block = self._block
        steps = walk.end() - self._position
        heading = 1 if steps > 0 else -1
        scale = walk.time_local[cell.SCALE] - 12
        self._state[stretch.TIME_SCALE] = scale
        self._high = walk.time[0]
        block[crossing.OFFSET] = walk.time[6] >> (16 - scale)
        if at_once:
            block[crossing.RANGE] = 0
        else:
            block[crossing.TARGET] = 2 * (self._position - walk.angle[0]) + heading + points.BIAS
            crossing.enter(block, walk.angle, walk.angle_local, walk.time_local)
        self._position += steps
        self._heading = heading
        self._last = steps * heading - 1
        self._at = 0
        self._at_once = at_once
        self._fresh = True
        self._comes = self._solve(0)

    def _solve(self, index: int) -> bool:
        """Set node A to the cell's step ``index``; False where braking ends before it."""
        solve(self._block, index, 0)
        return not self._braking or self._slow(A)

    def _slow(self, node: int) -> bool:
        """Move a node to real time; False where it never comes."""
        scale = self._state[stretch.TIME_SCALE]
        comes = braking.slow(self._block, node, self._high, scale)
        if comes and not self._at_once:
            braking.steepen(self._block, node)
        return bool(comes)

    def _first(self) -> None:
        """The first step of a cell, against the one that was held back before it."""
        if self._held:
            opposite = self._heading != self.direction
            close = self._since_held(self._high, self._ticks()) <= self._gap_ticks
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

    def _go_on(self) -> bool:
        """Prepare the next step or steps of the cell; True where some come."""
        steps = self._last - self._at
        # an odd one out comes first, so that the cell ends with a stretch, and time to look ahead
        odd = steps & 1 and steps < 2 * self._size
        if steps > 3 and not odd and not self._at_once and self._two_stretches(steps):
            return True
        if not self._solve(self._at + 1):
            self.ended = True
            return False
        self._at += 1
        self._single()
        return not self._held

    def _two_stretches(self, steps: int) -> bool:
        """Prepare two stretches that keep the error bound; False where steps are better solved singly."""
        block = self._block
        state = self._state
        size = self._size
        length = steps >> 1
        if length > size:
            length = steps // (2 * ((steps - 1) // (2 * size) + 1))
        state[BASE_HIGH] = self._high
        while length > 1:
            solve(block, self._at, length)
            verdict = accept(state, block, length) if not self._braking or self._level() else stretch.REJECTED
            if verdict != stretch.REJECTED:
                differences(state, block, length)
                self._origin = _CELL
                self._at += 2 * length
                if self._at == self._last and self._slowly():
                    state[NEXT_STEPS] -= 1
                    self._hold()
                if verdict == stretch.EASY and 2 * length > size:
                    self._size = min(2 * size, _LARGEST)
                return True
            length >>= 1
            self._size = max(length, 2)
        return False

    def _level(self) -> bool:
        """Move the nodes ahead to real time, and let all three count from the same base.

        False where braking ends before, or takes them too far apart.
        """
        block = self._block
        scale = self._state[stretch.TIME_SCALE]
        if not self._slow(crossing.MIDDLE) or not self._slow(B):
            return False
        base = block[A + DELAY] & ~4095
        if (block[B + DELAY] - base) >> (28 - scale):
            return False
        for node in _NODES:
            block[node] += (block[node + DELAY] - base) << scale
            block[node + DELAY] = base
        self._state[BASE_HIGH] = self._high + (base >> 12)
        return True

    def _single(self) -> None:
        """Prepare the step at node A."""
        if self._at == self._last and self._slowly():
            self._hold()
        else:
            self._origin = _CELL
            stretch.single(self._state, 0, self._high, self._ticks())

    def _hold(self) -> None:
        """Hold back the step at node A."""
        self._held = True
        self._held_high = self._high
        self._held_ticks = self._ticks()

    def _slowly(self) -> bool:
        """Whether the step at node A may be half of a graze.

        Acceleration near standstill is at most 0.16 steps / gap**2 (see check.py), so a joint that takes less than
        12 gaps for a step is not back within a gap; held against 4 of them.
        """
        ticks = self._block[A + crossing.MANTISSA] >> self._block[A + crossing.EXPONENT]
        return self._at_once or ticks > 4 * self._gap_ticks

    def _release(self) -> None:
        self._held = False
        self._origin = _RELEASED
        stretch.single(self._state, 0, self._held_high, self._held_ticks)

    def _since_held(self, high: int, ticks: int) -> int:
        """Ticks from the step held back to a time; any large number where it is far."""
        high -= self._held_high
        if high > _FAR:
            high = _FAR
        return (high << 12) + ticks - self._held_ticks

    def _ticks(self) -> int:
        """Time of node A in ticks from the high word of the part on."""
        scale = self._state[stretch.TIME_SCALE]
        ticks = (self._block[A] + (1 << (scale - 1))) >> scale
        return ticks + self._block[A + DELAY] if self._braking else ticks


def _in_1024(high: int, ticks: int) -> int:
    return ((high - points.BIAS) << 2) + (ticks >> 10)
