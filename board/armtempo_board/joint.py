"""One joint of a motion: from its walker to its ring, its DIR pin, and the count of what has been stepped."""

from array import array

import stm
from armtempo_shared import codes
from armtempo_shared.motion import Motion
from micropython import const
from pyb import Pin

from armtempo_board import access
from armtempo_board.ring import Ring, size
from armtempo_board.sampler import Sampler
from armtempo_board.walker import Walker

LOOKAHEAD_K = const(4096)
"""How far ahead steps are computed, in 1024 ticks: 50 ms. Braking begins behind what is computed."""

_PLENTY_K = const(3072)  # 37 ms: so far ahead nothing is added, as a few steps cost nearly what many do
_GUARD_K = const(16)  # 195 us: entries are only added behind a rising edge that is further away
_NEARLY_DRY_K = const(512)  # 6 ms: filling may take as long as what is left;
_GAP_K = const(1024)  # 12 ms: where nothing comes for so long, the ring is better filled afresh
_TURN_SLACK = const(8400)  # 100 us: how late the interrupt that turns DIR may come
_TURNS = const(8)


class Joint:
    """``head`` and ``row``: the arm record; ``sampler`` lends the memory that the interrupt reads."""

    def __init__(self, number: int, head: "dict[str, int]", row: "dict[str, int]", sampler: Sampler) -> None:
        from armtempo_board import pins  # here, so that it can be forgotten

        self._sampler = sampler
        self._block = sampler.block
        self._at = sampler.joint_at(number)
        self.ring = Ring(row["channel"], self._block, self._at, size(row["max_rate"]))
        self.walker = Walker()
        self._plenty = self.ring.entries * 3 // 4
        self._inverted = row["dir_inverted"]
        self._pulse = head["pulse_ticks"]
        self._pulse_k = (self._pulse >> 10) + 1
        self._turn_delay = head["dir_hold_ticks"] + _TURN_SLACK
        self.gap_ticks = max(
            self._pulse + self._turn_delay + _TURN_SLACK + head["dir_setup_ticks"],
            self._pulse + head["low_ticks"],
        )
        name = pins.STEP[row["channel"]][6]
        self._dir = Pin(name, Pin.OUT_PP, value=0)
        self._block[self._at + access.DIR_BIT] = 1 << int(name[1:])
        self._block[access.PULSE] = self._pulse
        self._block[access.SLACK] = _TURN_SLACK
        self._block[access.SETUP] = head["dir_setup_ticks"]
        self._turn_steps = array("i", [0] * _TURNS)
        self._direction = 1
        self._reset(0)
        self.over = True

    def _reset(self, position: int) -> None:
        """Count from here: the ring begins anew."""
        self._base = position
        self._base_steps = 0
        self._turns_in = self._turns_out = 0

    def load(self, motion: Motion, number: int) -> None:
        """Stand before a motion; the clock stands before 0."""
        position = self._base
        self.walker.load(motion, number, position, self._pulse, self.gap_ticks)
        self._direction = self.walker.direction
        self._dir.value((self._direction > 0) ^ self._inverted)
        self.ring.release()  # a motion may have been loaded and never started
        self.ring.stop()
        self._reset(position)
        self.over = False

    def position(self) -> int:
        """Commanded steps as the ring's count has them."""
        steps = self.ring.steps()
        while self._turns_out != self._turns_in:
            turned = self._turn_steps[self._turns_out & (_TURNS - 1)]
            if turned > steps:
                break
            self._base += self._direction * (turned - self._base_steps)
            self._base_steps = turned
            self._direction = -self._direction
            self._turns_out += 1
        return self._base + self._direction * (steps - self._base_steps)

    def written_k(self) -> int:
        """How far ahead steps are in the ring, in 1024 ticks, rounded up."""
        return self.ring.last_k() + 1 if self.ring.left() > 0 else 0

    def serve(self, now_k: int) -> int:
        """Keep the ring filled; code of a fault, or 0."""
        ring = self.ring
        left = ring.left()
        if left > 0:
            if left > self._plenty or ring.last_k() > _PLENTY_K:
                return 0
            if not self.walker.ended and ring.room(left) >= 2 and self._still_ahead():
                return self._extend(now_k, left)
        elif left == 0:
            if not self.walker.ended:
                return self._restart(now_k) if self._sampler.quiet() else 0
            if not self.over:
                ring.release()
                self.over = True
        return 0

    def _still_ahead(self) -> bool:
        return self.ring.last_k() - self._pulse_k > _GUARD_K

    def _extend(self, now_k: int, left: int) -> int:
        ring = self.ring
        room = ring.room(left)
        if self.walker.at_turn and not self._turn():
            return 0
        if ring.last_k() < _NEARLY_DRY_K and self.walker.next_1024() - now_k > _GAP_K:
            return 0
        made = ring.made()
        count = self.walker.fill(ring.words, ring.entries - 1, made, room, now_k + LOOKAHEAD_K)
        if count:
            late = ring.last_k() < self._pulse_k
            ring.seal(count)
            if late:
                return codes.UNDERRUN
        return 0

    def _turn(self) -> bool:
        """Queue the turn of DIR that the walker stands at; False while the queue is full."""
        if self._turns_in - self._turns_out >= _TURNS:
            return False
        if not access.add_turn(self._block, self.ring.state, self._at, self._turn_delay):
            return False
        self._turn_steps[self._turns_in & (_TURNS - 1)] = self.ring.made() >> 1
        self._turns_in += 1
        self.walker.turn()
        access.call_soon(stm.TIM2)
        return True

    def _restart(self, now_k: int) -> int:
        """Fill a ring that ran dry from its start, once steps come near."""
        ring = self.ring
        if self.walker.at_turn:
            ring.mark_now()
            if not self._turn():
                return 0
        if self.walker.next_1024() - now_k > LOOKAHEAD_K:
            ring.push_away()
            return 0
        if ring.made():
            self._rewind()
        count = self.walker.fill(ring.words, ring.entries - 1, 0, ring.room(0), now_k + LOOKAHEAD_K)
        if not count:
            return 0
        ring.seal(count)
        return 0 if ring.run() else codes.UNDERRUN

    def _rewind(self) -> None:
        """Empty the ring; the position stays."""
        self._reset(self.position())
        self.ring.stop()

    def settle(self, high: int) -> None:
        """The joint stands still for good; ``high``: STEP was high when all was frozen.

        A rising edge that came after the last word from DMA is not in the ring's count, but the pin shows it.
        """
        if high and self.ring.settled_low():
            self.position()
            self._base += self._direction
        self.ring.release()
        self.over = True

    def rest(self) -> None:
        """Stand still for good where the count says: the motion is forgotten."""
        self._rewind()

    def declare(self, steps: int) -> None:
        """The joint stands at ``steps``; nothing moves."""
        self._base = steps
