"""One STEP output: its pin, its ring of edge times and the DMA stream that feeds its compare register.

The stream fetches one word ahead of the match that asks for it (RM0090 10.3.12), so what stands in the
compare register and the word behind it are settled; only later words may still be written. Therefore new
entries are added while the last rising edge is still well ahead (see feeder.py), and an output that has run dry is
started afresh.
"""

from array import array

import stm
import uctypes
from machine import disable_irq, enable_irq, mem32
from micropython import const
from pyb import Pin

from armtempo_board.hardware import isr

_LASTS_MS = const(4)
_LEAST, _MOST = const(64), const(1024)


def size(rate: int) -> int:
    """Entries for a joint of at most ``rate`` steps/s: a power of two; full they last 4 ms, if 1024 can.

    The interrupt that fills it comes every 0.5 ms; nothing is added in the last 390 us.
    """
    wanted = 2 * rate * _LASTS_MS // 1000 + isr.SPARE
    entries = _LEAST
    while entries < min(wanted, _MOST):
        entries *= 2
    return entries


class Ring:
    """``channel`` indexes ``pins.STEP``; ``block`` and ``at``: the interrupt's memory, the place in it.

    ``entries``: see ``size``.
    """

    def __init__(self, channel: int, block: "array[int]", at: int, entries: int) -> None:
        from armtempo_board.hardware import pins, registers  # here, so that they can be forgotten

        pin, timer, compare, alternate, stream, dma_channel, _ = pins.STEP[channel]
        self.entries = entries
        self.words = array("I", bytearray(4 * entries + 4))
        self.state = memoryview(block)[at + isr.RING : at + isr.RING + isr.STATE_WORDS]
        self.state[isr.MASK] = entries - 1
        self._fed = memoryview(self.words)[1:]  # what the stream runs over
        self._block = block
        self._at = at
        self._mode = registers.stream_mode(dma_channel)
        self.timer = getattr(stm, "TIM%d" % timer)
        # addresses are large integers: made once, here
        self._registers = registers.stream_address(stream)
        self._ndtr = self._registers + 4 * isr.STREAM_NDTR
        self._flags, self._all_flags = registers.stream_flags(stream)
        address = registers.compare_address(timer, compare)
        registers.apply(registers.stream_rows(stream, dma_channel, address, uctypes.addressof(self._fed)))
        self._describe(pin, timer, compare)
        self.stop()
        Pin(pin, Pin.AF_PP, alt=alternate)

    def _describe(self, pin: str, timer: int, compare: int) -> None:
        block, at = self._block, self._at
        self.state[isr.NDTR_AT] = (self._ndtr - stm.DMA1) // 4
        block[at + isr.ON_TIM5] = timer == 5
        block[at + isr.CCR_AT] = isr.CCR1 + compare - 1
        block[at + isr.CCMR_AT] = isr.CCMR1 + (compare - 1) // 2
        block[at + isr.MODE_SHIFT] = 12 if compare % 2 == 0 else 4
        block[at + isr.ON_PORT_B] = pin[0] == "B"
        block[at + isr.PIN_BIT] = int(pin[1:])

    def matches(self) -> int:
        """Entries that have matched since the stream was started."""
        return isr.matches(self.state, stm.DMA1)

    def room(self) -> int:
        """Entries of an empty ring."""
        return self.entries - isr.SPARE

    def made(self) -> int:
        """Entries written since the stream was started."""
        return self.state[isr.MADE]

    def fed(self) -> int:
        """Whether the interrupt writes to the ring; it ends that where the ring has run dry."""
        return self.state[isr.FED]

    def feed(self, on: int) -> int:
        """Let the interrupt write to the ring, or not; returns what was."""
        before = self.state[isr.FED]
        self.state[isr.FED] = on
        if on:
            mem32[stm.TIM6] = 1  # CR1: it stops while no ring is fed
        return before

    def last_k(self) -> int:
        """Units of 1024 ticks from now to the last entry."""
        return isr.until_k(self.timer, self.state, isr.LAST)

    def stop(self) -> None:
        """Switch the stream off, ready to be filled from entry 0."""
        self.state[isr.FED] = 0
        mem32[self._registers] = self._mode
        mem32[self._flags] = self._all_flags
        mem32[self._ndtr] = self.entries
        self.state[isr.MADE] = 0
        self.state[isr.LOADS] = 0
        self.state[isr.FIRST] = self.entries

    def run(self, queue: "array[int]") -> int:
        """Take in what was written from entry 0 on, switch the stream on and let the output toggle.

        1 where the first entry came too late. ``queue``: see stretch.py.
        """
        isr.written(self.state, self.words, self.timer, queue)
        mem32[self._registers] = self._mode | isr.STREAM_ON
        self.state[isr.FIRST] = mem32[self._ndtr] & 0xFFFF
        before = disable_irq()
        late = isr.arm_channel(self._block, self.timer, self.words, self._at)
        enable_irq(before)
        self.feed(1)
        return late

    def release(self) -> None:
        """Hold the output low."""
        before = disable_irq()
        isr.release_channel(self._block, self.timer, self._at)
        enable_irq(before)

    def push_away(self) -> None:
        """Keep the compare value of a dry output far from the counter."""
        if isr.until_k(self.timer, self.state, isr.FAR) < 1 << 20:
            self.mark_now()
            isr.push_away(self.timer, self._block[self._at + isr.CCR_AT], self.state)

    def mark_now(self) -> None:
        """Count the last entry as being now: the output is dry, only turns of DIR are measured from it."""
        isr.mark(self.timer, self.state)
