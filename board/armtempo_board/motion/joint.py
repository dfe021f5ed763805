"""One joint of a motion: its walker and its ring, its DIR pin, and the count of what has been stepped.

The walker puts steps into its queue, from where an interrupt (feeder.py) writes them to the ring.
"""

from array import array

import stm
from armtempo_shared import codes
from armtempo_shared.motion import Motion
from micropython import const
from pyb import Pin

from armtempo_board.hardware import isr
from armtempo_board.hardware.ring import Ring, size
from armtempo_board.hardware.sampler import Sampler
from armtempo_board.stepgen.step_generator import Walker

LOOKAHEAD_K = const(4096)
"""How far ahead steps are computed, in 1024 ticks: 50 ms. Braking begins behind what is computed."""

_GUARD_K = const(16)  # 195 us: turns of DIR are only queued behind an edge that is further away
_DEAD_K = const(-164)  # 2 ms ago
_ENOUGH_K = const(256)  # 3 ms
_NEVER_K = const(1 << 29)
_TURN_SLACK = const(8400)  # 100 us: how late the interrupt that turns DIR may come
_TURNS = const(8)


class Joint:
    """``head`` and ``row``: the arm record; ``sampler`` lends the memory that the interrupt reads."""

    def __init__(self, number: int, head: "dict[str, int]", row: "dict[str, int]", sampler: Sampler) -> None:
        from armtempo_board.hardware import pins  # here, so that it can be forgotten

        self._sampler = sampler
        block = sampler.block
        self._at = sampler.joint_at(number)
        self.ring = Ring(row["channel"], block, self._at, size(row["max_rate"]))
        self.walker = Walker()
        self._inverted = row["dir_inverted"]
        self._turn_delay = head["dir_hold_ticks"] + _TURN_SLACK
        self.gap_ticks = max(
            head["pulse_ticks"] + self._turn_delay + _TURN_SLACK + head["dir_setup_ticks"],
            head["pulse_ticks"] + head["low_ticks"],
        )
        name = pins.STEP[row["channel"]][6]
        self._dir = Pin(name, Pin.OUT_PP, value=0)
        block[self._at + isr.DIR_BIT] = 1 << int(name[1:])
        block[isr.PULSE] = head["pulse_ticks"]
        block[isr.SLACK] = _TURN_SLACK
        block[isr.SETUP] = head["dir_setup_ticks"]
        self._turn_steps = array("i", [0] * _TURNS)
        self._direction = 1
        self._reset(0)
        self.over = True
        self.hungry = False  # more could be put into the queue at once
        self._enough_k = 0

    def _reset(self, position: int) -> None:
        """Count from here: the ring begins anew."""
        self._base = position
        self._base_steps = 0
        self._turns_in = self._turns_out = 0

    def load(self, motion: Motion, number: int) -> None:
        """Stand before a motion; the clock stands before 0."""
        position = self._base
        self.walker.load(motion, number, position, self._sampler.block[isr.PULSE], self.gap_ticks)
        self._direction = self.walker.direction
        self._dir.value((self._direction > 0) ^ self._inverted)
        self.ring.release()  # a motion may have been loaded and never started
        self.ring.stop()
        self._reset(position)
        self.over = False
        self._enough_k = -LOOKAHEAD_K  # nothing is to be done before

    def position(self, matches: int) -> int:
        """Commanded steps after so many matches of the ring; readings come in their order."""
        steps = (matches + 1) >> 1
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
        return self.ring.last_k() + 1 if self.ring.fed() else 0

    def serve(self, now_k: int) -> int:
        """Keep the queue filled; code of a fault, or 0."""
        self.hungry = False
        if now_k < self._enough_k:
            return 0
        walker = self.walker
        until_k = now_k + LOOKAHEAD_K
        self.hungry = walker.prepare(until_k)
        if not self.ring.fed():
            return self._dry(now_k) if self._sampler.quiet() else 0
        ahead_k = self.ring.last_k()
        if walker.at_turn and not walker.waits() and ahead_k > _GUARD_K and self._turn():
            self.hungry = True
        elif walker.latest_k() > until_k:
            self._enough_k = now_k + _ENOUGH_K
        return codes.INTERNAL if ahead_k < _DEAD_K else 0

    def _turn(self) -> bool:
        """Queue the turn of DIR that the walker stands at; False while the queue is full."""
        if self._turns_in - self._turns_out >= _TURNS:
            return False
        if not isr.add_turn(self._sampler.block, self.ring.state, self._at, self._turn_delay):
            return False
        self._turn_steps[self._turns_in & (_TURNS - 1)] = self.ring.made() >> 1
        self._turns_in += 1
        self.walker.turn()
        isr.call_soon(stm.TIM2)
        return True

    def _dry(self, now_k: int) -> int:
        """Fill a ring that has run dry from its start, once steps come near."""
        ring = self.ring
        walker = self.walker
        if not walker.waits():
            if walker.ended:
                ring.release()
                self.over = True
                self._enough_k = _NEVER_K
            elif walker.at_turn:
                ring.mark_now()
                self._turn()
            return 0
        if walker.next_1024() - now_k > LOOKAHEAD_K:
            ring.push_away()
            self._enough_k = now_k + _ENOUGH_K
            return 0
        if ring.made():
            self._rewind()
        if not walker.write(ring.words, ring.entries - 1, 0, ring.room()):
            return 0
        return codes.UNDERRUN if ring.run(walker.state) else 0

    def brake(self, start_ticks: int, length_ticks: int) -> None:
        """Come to rest along the path (see ``Walker.brake``)."""
        fed = self.ring.feed(0)
        self.walker.brake(start_ticks, length_ticks)
        self._enough_k = -LOOKAHEAD_K
        self.ring.feed(fed)

    def _rewind(self) -> None:
        """Empty the ring; the position stays."""
        self._reset(self.position(self.ring.matches()))
        self.ring.stop()

    def settle(self, high: int) -> None:
        """The joint stands still for good; ``high``: STEP was high when all was frozen.

        A rising edge that came after the last word from DMA is not in the ring's count, but the pin shows it.
        """
        matches = self.ring.matches()
        if high and matches & 1 == 0:
            self.position(matches)
            self._base += self._direction
        self.ring.release()
        self.over = True

    def rest(self) -> None:
        """Stand still for good where the count says: the motion is forgotten."""
        self._rewind()

    def declare(self, steps: int) -> None:
        """The joint stands at ``steps``; nothing moves."""
        self._base = steps
