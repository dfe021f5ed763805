"""One STEP output: its pin, its ring of edge times and the DMA stream that feeds its compare register.

The stream fetches one word ahead of the match that asks for it (RM0090 10.3.12). So the entry in the compare register
and the one after it can no longer be changed. Therefore new entries are added while the last rising edge is still well
ahead (see ``isr.rings_to_refill``), and a ring that has run out of entries is started anew.
"""

import stm
import uctypes
from machine import disable_irq, enable_irq, mem32
from micropython import const
from pyb import Pin

from armtempo_board.hardware import isr, pins, registers

TYPE_CHECKING = False
if TYPE_CHECKING:
    from array import array

NOT_FED = const(-(1 << 22))
"""Instead of a time in Ki ticks: the interrupt does not write to the ring."""
_FAR_KITICKS = const(1 << 20)
_FIRST_FED = const(1)  # entry that the stream begins with: entry 0 goes into the compare register by hand
# words of a ring's state, as isr.py names them
_LAST_TIME = const(3)
_FED = const(7)


class Ring:
    """``channel``: row of ``pins.STEP``. ``block``: the memory of the interrupts; ``at``: the joint's words in it.

    ``words``: of the edge times, one more than the ring has entries; the hardware uses them until it is stopped.
    """

    def __init__(self, channel: int, block: "array[int]", at: int, words: "memoryview") -> None:
        pin, timer, compare, alternate, stream, dma_channel = pins.STEP[channel]
        self.entries = entries = len(words) - 1
        self.words = words
        self.state = memoryview(block)[at + isr.RING : at + isr.RING + isr.STATE_WORDS]
        self.state[isr.MASK] = entries - 1
        self._fed = words[_FIRST_FED:]
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
        block[at + isr.CCR_AT] = isr.CCR1 + compare - 1
        block[at + isr.CCMR_AT] = isr.CCMR1 + (compare - 1) // 2
        block[at + isr.MODE_SHIFT] = 12 if compare % 2 == 0 else 4
        block[at + isr.ON_PORT_B] = pins.port(pin) == "B"
        block[at + isr.PIN_BIT] = pins.line(pin)

    def matches(self) -> int:
        """Entries that have matched since the stream was started."""
        return isr.matches(self.state, stm.DMA1)

    def written(self) -> int:
        """Entries written since the stream was started."""
        return self.state[isr.WRITTEN]

    def feed(self) -> None:
        """Let the interrupt write to the ring."""
        self.state[isr.FED] = 1
        mem32[stm.TIM6] = 1  # CR1: it stops while no ring is fed

    def fed_kiticks(self) -> int:
        """Ki ticks (1024 ticks) from now to the last entry; NOT_FED if the interrupt does not write to the ring."""
        return isr.kiticks_until(self.timer, self.state, _LAST_TIME) if self.state[_FED] else NOT_FED

    def stop(self) -> None:
        """Switch the stream off, ready to be filled from entry 0."""
        self.state[isr.FED] = 0
        mem32[self._registers] = self._mode
        mem32[self._flags] = self._all_flags
        mem32[self._ndtr] = self.entries
        self.state[isr.WRITTEN] = 0
        self.state[isr.MATCHED] = 0
        self.state[isr.NDTR_AT_START] = self.entries

    def run(self) -> int:
        """Entries were written from 0 on: switch the stream on and let the output toggle.

        1 if the first entry came too late.
        """
        mem32[self._registers] = self._mode | isr.STREAM_ON
        self.state[isr.NDTR_AT_START] = mem32[self._ndtr] & 0xFFFF
        before = disable_irq()
        late = isr.arm_channel(self._block, self.timer, self.words, self._at)
        enable_irq(before)
        self.feed()
        return late

    def release(self) -> None:
        """Hold the output low."""
        before = disable_irq()
        isr.release_channel(self._block, self.timer, self._at)
        enable_irq(before)

    def park_compare(self) -> None:
        """Keep the compare value of an empty ring far from the counter."""
        if isr.kiticks_until(self.timer, self.state, isr.FAR_TIME) < _FAR_KITICKS:
            self.set_last_to_now()
            isr.park_compare(self.timer, self._block[self._at + isr.CCR_AT], self.state)

    def set_last_to_now(self) -> None:
        """Take the time of the last entry for now: the ring is empty, only reversals of DIR are measured from it."""
        isr.copy_word(self.timer, isr.CNT, self.state, isr.LAST_TIME)
