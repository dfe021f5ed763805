"""Encoders on timers in encoder mode, counted beyond their 16 bits."""

import stm
from pyb import Pin

from armtempo_board.hardware import isr, pins, registers


class EncoderInput:
    """One encoder input. ``inverted``: it counts down when the joint's angle grows.

    Read it at least every 32 768 counts: at a million counts a second every 32 ms.
    """

    def __init__(self, channel: int, inverted: int) -> None:
        timer, first, second, alternate = pins.ENCODER[channel]
        for name in (first, second):
            Pin(name, Pin.AF_PP, pull=Pin.PULL_UP, alt=alternate)
        registers.apply(registers.encoder_rows(timer))
        self.address = getattr(stm, "TIM%d" % timer)
        self.counts = 0
        self._inverted = inverted
        self._last = isr.read_counter(self.address)

    def update(self) -> None:
        """Read the counter."""
        self.take(isr.read_counter(self.address))

    def take(self, counter: int) -> None:
        """Update the count from a reading of the counter; readings must be in their order."""
        moved = (counter - self._last) & 0xFFFF
        if moved >= 0x8000:
            moved -= 0x10000
        self._last = counter
        self.counts += -moved if self._inverted else moved

    def declare(self, counts: int) -> None:
        """Set the count to ``counts``."""
        self.update()
        self.counts = counts


class NoEncoder:
    """For a joint without an encoder: always 0."""

    counts = 0

    def take(self, number: int = 0) -> None:
        """Does nothing."""

    update = declare = take
