"""One joint's motion as a stream of step times: a step wherever the angle passes a half step."""

from array import array

from micropython import const

from armtempo_board import braking, cell, cells, crossing, points, stretch

_BUDGET = const(4)  # parts looked at in one call: bounds its time
_LARGEST_POWER = const(10)
_SMALLEST_POWER = const(2)
_DEVIATION = const(4)  # half ticks: the Hermite cubic over two stretches may miss the middle node by 2 ticks,
# so that each half is 16 times better by the h**4 law, with a factor of four to spare
_WHOLE = const((1 << 30) - 1)  # w at a cell's end
_FAR = const(1000)  # 4096 ticks: longer than any gap
_LONG = const(1 << 19)  # 1024 ticks: longer than any stretch
_NEVER = const(1 << 28)  # in 1024 ticks: 54 minutes


class Walker:
    """Walks one joint through a motion; every buffer is made once.

    ``direction`` (1 or -1) is that of the steps which ``fill`` writes now. ``at_turn``: the next step goes the
    other way, ``turn`` lets it come. ``ended``: no step is left.
    """

    def __init__(self):
        self._cells = cells.Cells()
        self._brake = braking.Brake()
        self._cell = array("i", bytes(80))
        self._state = array("i", bytes(4 * stretch.STATE_SIZE))
        self._a = array("i", bytes(4 * crossing.NODE_SIZE))
        self._middle = array("i", bytes(4 * crossing.NODE_SIZE))
        self._b = array("i", bytes(4 * crossing.NODE_SIZE))
        self._nodes = (self._a, self._middle, self._b)
        self.direction = 1
        self.at_turn = False
        self.ended = True

    def load(self, motion, joint, position_steps, pulse_ticks, gap_ticks):
        """Stand at the start of a motion with the joint at ``position_steps``.

        ``pulse_ticks``: STEP high time; ``gap_ticks``: least time between steps in opposite directions. Two that
        would be closer are both left out.
        """
        self._cells.load(motion, joint)
        self._cells.graze_ticks = gap_ticks >> 3
        self._brake.on = False
        self._state[stretch.PULSE] = pulse_ticks
        self._gap_ticks = gap_ticks
        self._position = position_steps + points.BIAS
        self.direction = 1
        self.at_turn = self.ended = False
        self._held = False  # the last step of a cell waits for what comes after it
        self._left = 0  # steps of the prepared stretch not written yet
        self._count = self._index = 0  # steps of the cell; the next of them
        self._power = 4
        while not self._left and not self.ended:
            if not self._prepare() and self.at_turn:
                self.turn()

    def fill(self, ring, mask, head, room, until_1024=_NEVER):
        """Write up to ``room`` edge times (rise, fall, ...; ticks modulo 2**32) to ``ring`` from ``head`` on.

        ``ring``: array('I') of ``mask`` + 1 entries, ``head`` even. Steps after ``until_1024`` (1024 ticks) wait for a
        later call, but for a few. Returns how many were written; 0: no room, none until then, at a turn,
        ended, or the search for the next step goes on with the next call.
        """
        written = 0
        while written + 2 <= room:
            if not self._left and not self._prepare():
                break
            count = stretch.within(self._state, min(until_1024 - self._base_1024, _LONG))
            if not count:
                break
            at = (head + written) & mask
            count = min(count, self._left, (room - written) >> 1, (mask + 1 - at) >> 1)
            stretch.emit(at, ring, self._state, count)
            self._left -= count
            written += 2 * count
        return written

    def turn(self):
        """Let the steps in the other direction come."""
        self.direction = -self.direction
        self.at_turn = False

    def brake(self, start_ticks, length_ticks):
        """Come to rest along the path from a time on (see braking.py); no step from there on may be written yet."""
        self._brake.set(start_ticks, length_ticks)
        self._halves = 0
        self._known = False
        if self._left and self._released:
            self._held = True
        else:
            self._index -= self._left
        self._left = 0
        if self._held:
            self._brake_held()
        if 0 < self._index < self._count:
            self._solve(self._a, self._index - 1, 0)

    def _brake_held(self):
        node = self._middle
        node[crossing.TIME] = self._held_ticks
        self._held = bool(braking.slow(node, self._brake.law, self._held_high, 0))
        self._held_ticks = node[crossing.TIME] + node[crossing.DELAY]

    def last_1024(self):
        """Time of the step written last, in 1024 ticks."""
        return self._base_1024 + stretch.elapsed(self._state, 0)

    def next_1024(self):
        """Time of the next step to be written, or one before it while it is not known; in 1024 ticks."""
        if self._left:
            return self._base_1024 + stretch.elapsed(self._state, 1)
        if self._held:
            return _in_1024(self._held_high, self._held_ticks)
        if self.at_turn:
            return _in_1024(self._cells.time[0], self._ticks(self._a))
        return _in_1024(self._cells.time[0], 0)

    def _prepare(self):
        """Make the next stretch ready. False: at a turn, at the end, or not found yet."""
        for _ in range(_BUDGET):
            if self.at_turn or self.ended:
                return False
            if self._index < self._count:
                self._in_cell()
            else:
                self._next_cell()
            if self._left:
                return True
        return False

    def _next_cell(self):
        found = self._cells.next(self._position)
        if found == cells.END or (self._brake.on and self._brake.passed(self._cells.time[0])):
            if self._held:
                self._release()
            else:
                self.ended = True
            return
        if self._held and self._since_held(self._cells.time[0], self._cells.time[6] >> 16) > self._gap_ticks:
            self._release()
        if found != cells.NOTHING:
            self._open(found == cells.AT_ONCE)

    def _open(self, at_once):
        """Take up the steps of the cell that was found."""
        steps = self._cells.end() - self._position
        heading = self._cells.heading
        if at_once:
            heading = 1 if steps > 0 else -1
        if steps * heading <= 0:
            return
        self._heading = heading
        self._count = steps * heading
        self._index = 0
        self._at_once = at_once
        self._known = False
        self._halves = 0
        scale = self._cells.time_local[cell.SCALE] - 12
        self._state[stretch.TIME_SCALE] = scale
        self._offset = self._cells.time[6] >> (16 - scale)
        if not at_once:
            self._straighten(heading)
        self._position += steps

    def _straighten(self, heading):
        """The cell's local polynomials, and its first threshold."""
        walk = self._cells
        cell.powers(walk.angle_local, self._cell, 0, heading < 0)
        cell.powers(walk.time_local, self._cell, 10, False)
        scale = walk.angle_local[cell.SCALE]
        self._scale = scale
        twice = 2 * (self._position - walk.angle[0]) + heading
        self._target = heading * ((twice << (scale - 1)) - (walk.angle[6] >> (28 - scale)))
        total = 0
        for i in range(cell.STEPS, cell.STEPS + 5):
            total += walk.angle_local[i] - cell.DIFFERENCE_BIAS
        self._range = total * heading
        self._a[crossing.W] = 0
        self._pace = _WHOLE // self._count  # about what a step adds to w

    def _solve(self, node, index, guess):
        """Set a node to the cell's step ``index``, its time in ticks * 2**TIME_SCALE from the high word on.

        False: braking ends before it.
        """
        target = 0 if self._at_once else self._target + (index << self._scale)
        if target <= 0:
            node[crossing.W] = node[crossing.TIME] = 0
        else:
            node[crossing.W] = guess
            crossing.solve(self._cell, node, min(target, self._range))
        node[crossing.TIME] += self._offset
        if not self._brake.on:
            return True
        return braking.slow(node, self._brake.law, self._cells.time[0], self._state[stretch.TIME_SCALE])

    def _in_cell(self):
        """Prepare the next step or steps of the cell."""
        if self._index == 0:
            self._first()
            return
        remaining = self._count - 1 - self._index
        if self._halves:
            self._second_half()
        elif remaining == 0:
            if self._step():
                self._hold()
        elif remaining < 2 << _SMALLEST_POWER or self._at_once or not self._block(remaining):
            if self._step():
                self._single()

    def _step(self):
        """Solve the next step by itself; False where braking ends before it."""
        comes = self._solve(self._a, self._index, self._ahead(0))
        self._index += 1
        self.ended = not comes
        return comes

    def _ahead(self, power):
        """About where 2**power steps on from node a lie; in quarters, to stay a small integer."""
        quarter = (self._a[crossing.W] >> 2) + (self._pace >> 2 << power)
        return (quarter if quarter < _WHOLE >> 2 else _WHOLE >> 2) << 2

    def _first(self):
        """The first step of a cell, against the one that was held back before it."""
        if not self._known:
            self._comes = self._solve(self._a, 0, 0)
            self._known = True
        if not self._comes:
            if self._held:
                self._release()
            else:
                self.ended = True
        elif self._held:
            opposite = self._heading != self.direction
            if opposite and self._since_held(self._cells.time[0], self._ticks(self._a)) <= self._gap_ticks:
                self._held = False  # a graze: neither comes
                self._index = 1
                self._known = False
            else:
                self._release()
        elif self._heading != self.direction:
            self.at_turn = True
        else:
            self._index = 1
            self._known = False
            if self._count == 1:
                self._hold()
            else:
                self._single()

    def _hold(self):
        self._held = True
        self._held_high = self._cells.time[0]
        self._held_ticks = self._ticks(self._a)

    def _since_held(self, high, ticks):
        """Ticks from the step held back to a time; any large number where it is far."""
        high -= self._held_high
        if high > _FAR:
            high = _FAR
        return (high << 12) + ticks - self._held_ticks

    def _ticks(self, node):
        """A node's time in ticks from the high word of the part on."""
        scale = self._state[stretch.TIME_SCALE]
        delay = node[crossing.DELAY] if self._brake.on else 0
        return ((node[crossing.TIME] + (1 << (scale - 1))) >> scale) + delay

    def _release(self):
        self._held = False
        self._released = True
        self._write(self._held_high, self._held_ticks)

    def _single(self):
        self._released = False
        self._write(self._cells.time[0], self._ticks(self._a))

    def _write(self, high, ticks):
        stretch.single(self._state, high, ticks)
        self._base_1024 = _in_1024(high, ticks)
        self._left = 1

    def _block(self, remaining):
        """Find two stretches from node a on that keep the error bound; False where steps are better solved singly."""
        power = self._power
        while 2 << power > remaining:
            power -= 1
        self._slope(self._a)
        here = self._index - 1
        start = self._a[crossing.W]
        comes = self._solve(self._b, here + (2 << power), self._ahead(power + 1))
        self._pace = (self._b[crossing.W] - start) >> power + 1
        self._slope(self._b)
        while power >= _SMALLEST_POWER:
            if self._solve(self._middle, here + (1 << power), (start >> 1) + (self._b[crossing.W] >> 1)):
                self._slope(self._middle)
                if comes and self._level() and self._accept(power):
                    self._halves = 2
                    self._block_power = power
                    self._second_half()
                    return True
                comes = True
            power -= 1
            self._power = power
            self._b, self._middle = self._middle, self._b
        self._power = _SMALLEST_POWER
        return False

    def _slope(self, node):
        crossing.slope(node, self._state[stretch.TIME_SCALE] - self._scale)
        if self._brake.on:
            braking.steepen(node)

    def _level(self):
        """Let the times of the three nodes count from the same base; False where braking takes them too far apart."""
        high = self._cells.time[0]
        state = self._state
        state[stretch.BASE_HIGH] = high
        if not self._brake.on:
            return True
        base = self._a[crossing.DELAY] & ~4095
        state[stretch.BASE_HIGH] = high + (base >> 12)
        scale = state[stretch.TIME_SCALE]
        for node in self._nodes:
            delay = node[crossing.DELAY] - base
            if delay >> (28 - scale):
                return False
        for node in self._nodes:
            node[crossing.TIME] += (node[crossing.DELAY] - base) << scale
            node[crossing.DELAY] = base
        return True

    def _accept(self, power):
        """Whether the stretches a-middle and middle-b of 2**power steps keep the error bound."""
        state = self._state
        nearest = crossing.EXPONENT
        exponent = min(self._a[nearest], self._middle[nearest], self._b[nearest])
        if exponent < power + 3 or exponent + 5 < 3 * power:
            return False
        state[stretch.POWER] = power
        state[stretch.EXPONENT] = exponent
        limit = _DEVIATION << state[stretch.TIME_SCALE]
        off = stretch.deviation(state, self._a, self._middle, self._b)
        if off <= limit >> 6 and power == self._power < _LARGEST_POWER:
            self._power = power + 1
        return off <= limit

    def _second_half(self):
        """Prepare the stretch from node a to the middle; the middle is the next node a."""
        state = self._state
        self._released = False
        state[stretch.POWER] = self._block_power
        stretch.differences(state, self._a, self._middle)
        self._base_1024 = _in_1024(state[stretch.BASE_HIGH], self._a[crossing.TIME] >> state[stretch.TIME_SCALE])
        self._left = 1 << self._block_power
        self._index += self._left
        self._halves -= 1
        self._a, self._middle, self._b = self._middle, self._b, self._a


def _in_1024(high, ticks):
    return ((high - points.BIAS) << 2) + (ticks >> 10)
