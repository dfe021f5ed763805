"""Compare channels of a timer: matches, fed by DMA or not, and what they do to the output (RM0090 18.3.7).

Between two updates of a timer its channels cannot influence one another, so each processes all its matches
of that interval in one tight loop (``Channel.match``): that loop is the cost of an edge.
"""

from chip import memory
from chip.timer_registers import CCER, CCMR1, CCR1, CR1, DIER, NEVER, SR

DMA_DELAY_TICKS = 6
"""A compare value that comes this close after its predecessor is too late (bus delay)."""
_FROZEN, _ACTIVE, _INACTIVE, _TOGGLE, _LOW, _HIGH, _PWM, _PWM_INVERTED = range(8)


class Channel:
    """One compare channel. ``due`` is the timer's total count at its next match."""

    def __init__(self, timer, number):
        self.timer = timer
        self.number = number
        self.ccr_at = timer.at + CCR1 + number - 1
        self.ccr = 0
        self.due = NEVER
        self.mode = _FROZEN
        self.output = False
        self.inverted = False
        self.level = 0
        self.shown = 0
        self.stream = None
        self.interrupt = False
        self.sink = None
        self.pulses = None  # in PWM mode: ticks that the output is high, and of the period

    def _registers(self):
        """(mode, output enabled, inverted) as the registers have them now."""
        words = memory.words
        shift = 8 * ((self.number - 1) & 1)
        setting = words[self.timer.at + CCMR1 + ((self.number - 1) >> 1)] >> shift
        enable = words[self.timer.at + CCER] >> (4 * (self.number - 1))
        mode = (setting >> 4) & 7 if setting & 3 == 0 else _FROZEN
        return mode, bool(enable & 1), bool(enable & 2)

    def sync(self, total, now):
        """The program may have written the channel's registers."""
        self.mode, self.output, self.inverted = self._registers()
        if self.mode == _PWM_INVERTED:
            raise ValueError(
                "TIM%d channel %d: PWM mode 2 is not simulated" % (self.timer.number, self.number)
            )
        self._sync_pulses(now)
        if self.mode == _PWM:
            self.due = NEVER
            return
        enabled = memory.words[self.timer.at + DIER] >> self.number
        self.interrupt = bool(enabled & 1)
        dma = (enabled >> 8) & 1
        self.stream = self.timer.board.dma.feeding(self.timer.number, self.number) if dma else None
        if self.stream and self.stream.target() != self.ccr_at:
            raise ValueError("DMA1 stream %d does not write its channel" % self.stream.number)
        ccr = memory.words[self.ccr_at]
        if ccr != self.ccr or self.due == NEVER:
            self.ccr = ccr
            self.plan(total)
        if self.mode >= _LOW:
            self.level = self.mode - _LOW
        self._show(now)

    def _sync_pulses(self, now):
        """Pulses are not made one by one: what they are is told where it changes."""
        timer = self.timer
        pulses = None
        if self.mode == _PWM and self.output and memory.words[timer.at + CR1] & 1 and timer.clocked:
            high = min(memory.words[self.ccr_at], timer.modulus)
            pulses = high * timer.scale // timer.rate, timer.modulus * timer.scale // timer.rate
        if pulses != self.pulses:
            self.pulses = pulses
            for line in timer.board.pins.of_channel(timer.number, self.number):
                line.pulse(pulses or (0, 0), now)

    def plan(self, total):
        """Find the next match of the present compare value."""
        timer = self.timer
        if self.mode == _PWM:
            return
        if self.ccr >= timer.modulus:
            self.due = NEVER
            return
        gap = (self.ccr - timer.count(total)) % timer.modulus
        self.due = total + (gap or timer.modulus)

    def _show(self, now):
        """Bring the pin to the channel's level."""
        shown = (self.level ^ self.inverted) if self.output else 0
        if shown != self.shown:
            self.shown = shown
            if self.sink:
                self.sink.edges(1 - shown, 1, (now,), 0)

    def match(self, total):
        """All matches up to the timer's ``total``."""
        times = []
        count = self._match_fed(total, times) if self.stream else self._match_alone(total, times)
        memory.poke(self.timer.at + SR, memory.words[self.timer.at + SR] | 1 << self.number)
        if self.interrupt:
            self.timer.board.pend(self.timer.number, self.number)
        self._drive(count, times)

    def _match_alone(self, total, times):
        due = self.due
        modulus = self.timer.modulus
        if self.mode == _FROZEN:
            self.due += (1 + (total - due) // modulus) * modulus
            return 0
        while due <= total:
            times.append(due)
            due += modulus
        self.due = due
        return len(times)

    def _match_fed(self, total, times):
        stream = self.stream
        ring, size, place, ahead = stream.ring, stream.size, stream.place, stream.ahead
        due, ccr = self.due, self.ccr
        preload = self.timer.board.dma_preload
        count = 0
        while due <= total:
            times.append(due)
            count += 1
            if not preload:
                ahead = ring[place - 1] & 0xFFFFFFFF
            gap = (ahead - ccr) & 0xFFFFFFFF
            ccr = ahead
            due += gap if gap > DMA_DELAY_TICKS else gap + 0x100000000
            ahead = ring[place] & 0xFFFFFFFF
            place += 1
            if place == size:
                place = 0
        self.due, self.ccr = due, ccr
        stream.place, stream.ahead = place, ahead
        stream.moved(count)
        memory.poke(self.ccr_at, ccr)
        return count

    def _drive(self, count, times):
        """The matches act on the output."""
        mode = self.mode
        if mode == _FROZEN or mode >= _LOW:
            return
        if mode != _TOGGLE:
            self.level = 2 - mode
            self._show(self.timer.tick_at(times[0]))
            return
        before = self.shown
        self.level ^= count & 1
        if self.output:
            self.shown = self.level ^ self.inverted
            if self.sink:
                origin = self.timer.origin
                if self.timer.scale != 1:
                    times, origin = [self.timer.tick_at(time) for time in times], 0
                self.sink.edges(before, count, times, origin)
