"""The compare interrupt of TIM2 channel 4: samples at exact times of the motion, and reversals of the DIR pins.

The interrupt stores raw samples; ``next_raw`` gives them to the main loop in their order.
"""

from array import array

import micropython
import stm
from armtempo_shared.limits import SAMPLE_TICKS
from machine import mem32
from micropython import const
from pyb import Timer

from armtempo_board.hardware import isr

_LOW32 = 0xFFFFFFFF
_COMPARE_4 = const(1 << 4)  # CC4IE in DIER
_QUIET_KITICKS = const(80)  # 1 ms
_OVERDUE_KITICKS = const(-40)  # 0.5 ms ago


class Sampler:
    """Owns the memory that the interrupts share. It is made once; ``configure`` it for an arm."""

    def __init__(self) -> None:
        self.block = array("I", bytearray(4 * isr.BLOCK_WORDS))
        self.raw = array("I", bytearray(4 * isr.RAW_WORDS * isr.RAW_SPACE))
        self._counters: "tuple[int, ...]" = ()
        self._timer2 = stm.TIM2
        self._directions = stm.GPIOE
        self._dma = stm.DMA1
        self._regular = 0
        self._hook = self._interrupt  # bound once: making a bound method allocates

    def configure(self, joints: int, counters: "tuple[int, ...]") -> None:
        """For an arm of that many joints; ``counters``: addresses of the encoder timers in use."""
        for word in range(isr.BLOCK_WORDS):
            self.block[word] = 0
        self.block[isr.JOINTS] = joints
        self.block[isr.ENCODERS] = len(counters)
        self.block[isr.SAMPLES_DONE] = 1
        self._counters = counters

    def connect(self) -> None:
        """Set the interrupt up. It starts TIM2, so set the timers up after it."""
        timer = Timer(2, prescaler=0, period=0x3FFFFFFF)
        timer.channel(4, Timer.OC_TIMING, callback=self._hook)  # type: ignore[arg-type]

    @micropython.viper
    def _interrupt(self, timer: object) -> object:
        # the first pin turns 9 us after the match (see docs/hardware.md)
        while int(isr.serve_compare(self.block, self._timer2, self._directions)):
            isr.take_sample(self.raw, self.block, self._dma, self._counters, self._timer2)

    def joint_at(self, joint: int) -> int:
        """Index of a joint's first word in the block."""
        return isr.BLOCK_HEAD + joint * isr.JOINT_WORDS

    def plan(self, duration_ticks: int) -> None:
        """Samples at 0, then every SAMPLE_TICKS, and one at the end."""
        block = self.block
        for joint in range(block[isr.JOINTS]):
            at = self.joint_at(joint)
            block[at + isr.REVERSALS_OUT] = block[at + isr.REVERSALS_IN]
        for word in (isr.RAW_IN, isr.RAW_OUT, isr.RAW_LOST, isr.REVERSAL_LATE):
            block[word] = 0
        block[isr.NEXT_SAMPLE] = 0
        self._regular = -(-duration_ticks // SAMPLE_TICKS)  # samples before the last
        block[isr.SAMPLES_LEFT] = self._regular
        block[isr.LAST_SAMPLE] = duration_ticks & _LOW32
        block[isr.SAMPLES_DONE] = 0
        mem32[self._timer2 + 4 * isr.CCR4] = 0
        mem32[self._timer2 + 4 * isr.SR] = 0
        mem32[self._timer2 + 4 * isr.DIER] = _COMPARE_4

    def end_at(self, ticks: int) -> None:
        """The motion ends at another time than planned. Call it only while ``quiet``."""
        block = self.block
        begun = self._regular - block[isr.SAMPLES_LEFT]
        self._regular = max(-(-ticks // SAMPLE_TICKS), begun)
        left = self._regular - begun
        block[isr.LAST_SAMPLE] = ticks & _LOW32
        block[isr.NEXT_SAMPLE] = (begun * SAMPLE_TICKS if left else ticks) & _LOW32
        block[isr.SAMPLES_LEFT] = left
        isr.interrupt_soon(self._timer2)

    def waits(self) -> bool:
        """Whether raw samples wait to be converted."""
        return self.block[isr.RAW_IN] != self.block[isr.RAW_OUT]

    def quiet(self) -> bool:
        """Whether all raw samples are converted and the next is at least 1 ms away."""
        block = self.block
        if self.waits():
            return False
        return (
            block[isr.SAMPLES_DONE] != 0
            or isr.kiticks_until(self._timer2, block, isr.NEXT_SAMPLE) >= _QUIET_KITICKS
        )

    def overdue(self, joint: int) -> bool:
        """Whether a sample or a reversal of the joint was due 0.5 ms ago: the interrupt comes no more."""
        block = self.block
        at = self.joint_at(joint)
        out = block[at + isr.REVERSALS_OUT]
        due = at + isr.REVERSAL_TIMES + (out & (isr.MOST_REVERSALS - 1))
        if (
            out != block[at + isr.REVERSALS_IN]
            and isr.kiticks_until(self._timer2, block, due) < _OVERDUE_KITICKS
        ):
            return True
        return (
            block[isr.SAMPLES_DONE] == 0
            and isr.kiticks_until(self._timer2, block, isr.NEXT_SAMPLE) < _OVERDUE_KITICKS
        )

    def done(self) -> bool:
        """Whether the last sample has been taken and converted."""
        return self.block[isr.SAMPLES_DONE] != 0 and not self.waits()

    def next_raw(self) -> int:
        """Index of the oldest raw sample in ``raw``, or -1; ``drop`` it when it has been converted."""
        read = self.block[isr.RAW_OUT]
        if read == self.block[isr.RAW_IN]:
            return -1
        return (read & (isr.RAW_SPACE - 1)) * isr.RAW_WORDS

    def drop(self) -> None:
        """The oldest raw sample has been converted."""
        self.block[isr.RAW_OUT] = (self.block[isr.RAW_OUT] + 1) & 0xFF

    def take_now(self) -> None:
        """Store a raw sample of this moment, the last; the interrupt must be off."""
        block = self.block
        block[isr.SAMPLES_LEFT] = 0
        isr.take_sample(self.raw, block, self._dma, self._counters, self._timer2)
