"""The compare interrupt of TIM2 channel 4: samples on the motion's clock, and turns of the DIR pins.

The interrupt stores raw readings; ``next_raw`` hands them to the main loop in their order.
"""

from array import array

import micropython
import stm
from armtempo_shared.limits import MAX_JOINTS, SAMPLE_TICKS
from machine import mem32
from micropython import const
from pyb import Timer

from armtempo_board import access

_LOW32 = 0xFFFFFFFF
_QUIET_K = const(80)  # 1 ms
_DEAD_K = const(-40)  # 0.5 ms ago


class Sampler:
    """Owns the memory shared with the interrupts. ``counters``: addresses of the encoder timers in use."""

    def __init__(self, joints: int, counters: "tuple[int, ...]") -> None:
        words = access.BLOCK_HEAD + MAX_JOINTS * access.JOINT_WORDS
        self.block = array("I", bytearray(4 * words))
        self.raw = array("I", bytearray(4 * access.RAW_WORDS * access.RAW_ROOM))
        self.block[access.JOINTS] = joints
        self.block[access.ENCODERS] = len(counters)
        self.block[access.DONE] = 1
        self._counters = counters
        self._timer2 = stm.TIM2
        self._directions = stm.GPIOE
        self._dma = stm.DMA1
        self._regular = 0
        self._hook = self._interrupt  # bound once: making a bound method allocates

    def connect(self) -> None:
        """Hook the interrupt. Starts TIM2, so set the timers up after it."""
        timer = Timer(2, prescaler=0, period=0x3FFFFFFF)
        timer.channel(4, Timer.OC_TIMING, callback=self._hook)  # type: ignore[arg-type]

    @micropython.viper
    def _interrupt(self, timer: object) -> object:
        # 9 us before the first pin turns (see docs/hardware.md)
        while int(access.serve(self.block, self._timer2, self._directions)):
            access.take(self.raw, self.block, self._dma, self._counters)

    def joint_at(self, joint: int) -> int:
        """Place of a joint's words in the block."""
        return access.BLOCK_HEAD + joint * access.JOINT_WORDS

    def plan(self, duration_ticks: int) -> None:
        """Samples at 0, then every SAMPLE_TICKS, and one at the end."""
        block = self.block
        for joint in range(block[access.JOINTS]):
            at = self.joint_at(joint)
            block[at + access.TURNS_OUT] = block[at + access.TURNS_IN]
        for word in (access.TAKEN, access.READ, access.LOST, access.FROZEN, access.HIGH, access.LATE):
            block[word] = 0
        block[access.NEXT] = 0
        self._regular = -(-duration_ticks // SAMPLE_TICKS)  # samples before the last
        block[access.LEFT] = self._regular
        block[access.END] = duration_ticks & _LOW32
        block[access.DONE] = 0
        mem32[self._timer2 + 4 * access.CCR4] = 0
        mem32[self._timer2 + 4 * access.SR] = 0
        mem32[self._timer2 + 4 * access.DIER] = 1 << 4

    def end_at(self, ticks: int) -> None:
        """The motion ends at another time than planned. Call it while no sample is due."""
        block = self.block
        begun = self._regular - block[access.LEFT]
        self._regular = max(-(-ticks // SAMPLE_TICKS), begun)
        left = self._regular - begun
        block[access.END] = ticks & _LOW32
        block[access.NEXT] = (begun * SAMPLE_TICKS if left else ticks) & _LOW32
        block[access.LEFT] = left
        access.call_soon(self._timer2)

    def waits(self) -> bool:
        """Whether raw samples are to be converted."""
        return self.block[access.TAKEN] != self.block[access.READ]

    def quiet(self) -> bool:
        """Whether all raw samples are converted and the next is at least 1 ms away."""
        block = self.block
        if self.waits():
            return False
        return block[access.DONE] != 0 or access.until_k(self._timer2, block, access.NEXT) >= _QUIET_K

    def overdue(self, joint: int) -> bool:
        """Whether a sample or a turn of the joint was due long ago: the interrupt comes no more."""
        block = self.block
        at = self.joint_at(joint)
        out = block[at + access.TURNS_OUT]
        turn = at + access.TURN_TIMES + (out & (access.TURN_ROOM - 1))
        if out != block[at + access.TURNS_IN] and access.until_k(self._timer2, block, turn) < _DEAD_K:
            return True
        return block[access.DONE] == 0 and access.until_k(self._timer2, block, access.NEXT) < _DEAD_K

    def done(self) -> bool:
        """Whether the last sample has been taken and converted."""
        return self.block[access.DONE] != 0 and not self.waits()

    def next_raw(self) -> int:
        """Place of the oldest raw sample in ``raw``, or -1; ``drop`` it when it has been converted."""
        read = self.block[access.READ]
        if read == self.block[access.TAKEN]:
            return -1
        return (read & (access.RAW_ROOM - 1)) * access.RAW_WORDS

    def drop(self) -> None:
        """The oldest raw sample has been converted."""
        self.block[access.READ] = (self.block[access.READ] + 1) & 0xFF

    def take_now(self) -> None:
        """Store a raw sample of this moment, the last; the interrupt must be off."""
        block = self.block
        block[access.NOW] = mem32[self._timer2 + 4 * access.CNT] & _LOW32
        block[access.LEFT] = 0
        access.take(self.raw, block, self._dma, self._counters)
