"""The motion clock: TIM2 extended to 64 bits. TIM5, for the other rings, starts and stops with it."""

import time

import stm
from machine import mem32
from micropython import const

from armtempo_board.hardware import isr

_START_US = const(50)
_START_CHECKS = const(5)


class MotionClock:
    """``epoch`` * 2**32 + ``counter_kiticks`` * 1024 ticks: its time at the last reading (``kiticks``)."""

    def __init__(self) -> None:
        self.epoch = 0
        self.counter_kiticks = 0

    def set(self, ticks: int) -> None:
        """Set the time; negative before time 0."""
        mem32[stm.TIM2 + 4 * isr.CNT] = ticks & 0xFFFFFFFF
        mem32[stm.TIM5 + 4 * isr.CNT] = ticks & 0xFFFFFFFF
        self.epoch = ticks >> 32
        self.counter_kiticks = isr.counter_kiticks(stm.TIM2)

    def start(self) -> bool:
        """Start both counters; returns whether they agree."""
        before_kiticks = isr.counter_kiticks(stm.TIM2)
        mem32[stm.TIM2 + 4 * isr.CR1] = 1
        time.sleep_us(_START_US)
        for _ in range(_START_CHECKS):
            if isr.counters_agree(stm.TIM2, stm.TIM5) and isr.counter_kiticks(stm.TIM2) != before_kiticks:
                return True
        return False

    def stop(self) -> None:
        """Stop it, the timer that fills the rings, and the compare interrupt."""
        mem32[stm.TIM6] = 0
        mem32[stm.TIM2 + 4 * isr.DIER] = 0
        mem32[stm.TIM2 + 4 * isr.CR1] = 0
        mem32[stm.TIM5 + 4 * isr.CR1] = 0

    def kiticks(self) -> int:
        """Read it, in Ki ticks (1024 ticks): a small integer."""
        low = isr.counter_kiticks(stm.TIM2)
        if low < self.counter_kiticks:
            self.epoch += 1
        self.counter_kiticks = low
        return (self.epoch << 22) + low

    def ticks(self) -> int:
        """Its time in ticks, 64 bits; negative before time 0. Does not count as a reading."""
        counter = mem32[stm.TIM2 + 4 * isr.CNT] & 0xFFFFFFFF
        epoch = self.epoch + (1 if counter >> 10 < self.counter_kiticks else 0)
        return int((epoch << 32) + counter)
