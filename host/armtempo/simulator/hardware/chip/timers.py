"""Timers and their compare channels: counting, updates, start by trigger, encoder mode, matches (RM0090 17 and 18).

Between two updates of a timer its channels are independent, so each handles all its matches of that interval
in one loop (``Channel.match``), which is most of the cost of an edge.
"""

from chip import memory

# offsets of registers in words (RM0090 18.4.21)
CR1, CR2, SMCR, DIER, SR, EGR, CCMR1, CCMR2, CCER, CNT, PSC, ARR = range(12)
CCR1 = 13
BDTR = 17
NEVER = 1 << 50
"""A tick that never comes."""
DMA_DELAY_TICKS = 6
"""A compare value this close to its predecessor arrives too late (bus delay)."""
_FROZEN, _ACTIVE, _INACTIVE, _TOGGLE, _LOW, _HIGH, _PWM, _PWM_INVERTED = range(8)
_REBASE = 1 << 27


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
        """(mode, output enabled, inverted) from the registers."""
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
        """Report a change of the PWM; its single edges are not simulated."""
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
        """Set the pin to the channel's level."""
        shown = (self.level ^ self.inverted) if self.output else 0
        if shown != self.shown:
            self.shown = shown
            if self.sink:
                self.sink.edges(1 - shown, 1, (now,), 0)

    def match(self, total):
        """Handle all matches up to the timer's ``total``."""
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
        """Apply the matches to the output."""
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


class TimerUnit:
    """One timer. ``total`` counts since the tick ``origin`` determine CNT."""

    def __init__(self, board, number, bits, rate=1):
        self.board = board
        self.number = number
        self.at = memory.index("TIM%d" % number)
        self.full = 1 << bits
        self.modulus = self.full
        self.rate = rate
        self.scale = 1
        self.divider = 1  # an injected fault: its clock is divided by this
        self.plain = rate == 1  # one count a tick
        self.origin = 0
        self.total = 0
        self.base = 0
        self.running = False
        self.encoder = False
        self.clocked = False
        self.next = NEVER
        self.next_update = NEVER
        self.follower = None
        self.channels = [Channel(self, number) for number in (1, 2, 3, 4)]
        memory.poke(self.at + ARR, self.full - 1)

    def count(self, total):
        """CNT at the count ``total``."""
        return (self.base + total) % self.modulus

    def tick_at(self, total):
        """Absolute tick at which a total count is reached."""
        return self.origin - (-total * self.scale // self.rate)

    def sync(self, now):
        """The program may have written the timer's registers."""
        words = memory.words
        encoder = words[self.at + SMCR] & 7 in (1, 2, 3)
        if encoder != self.encoder:
            self.encoder = encoder
            self._restart(now, words[self.at + CNT])
            self.board.recount()
        memory.poke(self.at + SR, words[self.at + SR] & memory.seen[self.at + SR])
        self._sync_count(now)
        if words[self.at + EGR]:
            if words[self.at + EGR] & 1:
                self._update(now)
            memory.poke(self.at + EGR, 0)
        elif not words[self.at + CR1] & 0x80:
            self._reload(words[self.at + ARR])
        self._sync_enable(now)
        makes_pulses = [channel.pulses is not None for channel in self.channels]
        for channel in self.channels:
            channel.sync(self.total, now)
        if makes_pulses != [channel.pulses is not None for channel in self.channels]:
            self.board.recount()
        self._find_next()

    def _sync_count(self, now):
        written = memory.words[self.at + CNT]
        if written != memory.seen[self.at + CNT]:
            memory.poke(self.at + CNT, written % self.modulus)
            self._restart(now, written % self.modulus)

    def _restart(self, now, count):
        """Count from ``count``, from ``now`` on."""
        self.origin = now
        self.total = 0
        self.base = count
        for channel in self.channels:
            channel.plan(0)

    def _reload(self, arr):
        if arr + 1 != self.modulus:
            self.modulus = arr + 1
            for channel in self.channels:
                channel.plan(self.total)

    def _update(self, now):
        """An update event (UG): prescaler and period take effect, the counter starts from 0."""
        self.scale = ((memory.words[self.at + PSC] & 0xFFFF) + 1) * self.divider
        self.plain = self.rate == 1 and self.scale == 1
        self._reload(memory.words[self.at + ARR] & (self.full - 1))
        memory.poke(self.at + CNT, 0)
        memory.poke(self.at + SR, memory.words[self.at + SR] | 1)
        self._restart(now, 0)

    def _sync_enable(self, now):
        running = bool(memory.words[self.at + CR1] & 1) and self.clocked
        if running == self.running:
            return
        self._restart(now, memory.words[self.at + CNT])
        self.running = running
        self.board.recount()
        for observer in self.board.observers:
            observer.counting(self, now)
        if running and self.follower and (memory.words[self.at + CR2] >> 4) & 7 == 1:
            self.follower.triggered(now)

    def triggered(self, now):
        """The trigger input rose: in trigger mode the counter starts (RM0090 18.3.14)."""
        if memory.words[self.at + SMCR] & 0x77 == 6:
            memory.poke(self.at + CR1, memory.words[self.at + CR1] | 1)
            self._sync_enable(now)
            self._find_next()

    def _find_next(self):
        due = NEVER
        for channel in self.channels:
            if channel.due < due:
                due = channel.due
        self.next_update = NEVER
        if memory.words[self.at + DIER] & 1:
            self.next_update = self.total + self.modulus - self.count(self.total)
            due = min(due, self.next_update)
        self.next = due

    def counts_by_clock(self):
        """Whether the counter counts a clock, not an encoder."""
        return self.running and not self.encoder and not any([channel.pulses for channel in self.channels])

    def next_interrupt(self):
        """Absolute tick of the next interrupt, or NEVER."""
        due = self.next_update
        for channel in self.channels:
            if channel.interrupt and channel.due < due:
                due = channel.due
        return NEVER if due == NEVER else self.tick_at(due)

    def next_match(self):
        """Absolute tick of the next match or update, or NEVER."""
        return NEVER if self.next == NEVER else self.tick_at(self.next)

    def run(self, now):
        """Time has come to ``now``."""
        total = now - self.origin
        if not self.plain:
            total = total * self.rate // self.scale
        if total >= self.next:
            self._matches(total)
        self.total = total
        count = self.base + total
        if count >= self.modulus:
            count %= self.modulus
        memory.words[self.at + CNT] = memory.seen[self.at + CNT] = count
        if total > _REBASE and self.plain:
            self._rebase(total)

    def _matches(self, total):
        if self.next_update <= total:
            memory.poke(self.at + SR, memory.words[self.at + SR] | 1)
            self.board.pend(self.number, 0)
        for channel in self.channels:
            if channel.due <= total:
                channel.match(total)
        self.total = total
        self._find_next()

    def _rebase(self, total):
        """Keep the numbers small: 32-bit MicroPython allocates those beyond 30 bits on the heap."""
        self.base = (self.base + total) % self.modulus
        self.origin += total
        self.total = 0
        for channel in self.channels:
            if channel.due != NEVER:
                channel.due -= total
        self._find_next()

    def acknowledge(self, flag):
        """Clear a flag, as the interrupt handler does before the callback."""
        memory.poke(self.at + SR, memory.words[self.at + SR] & ~(1 << flag))

    def turn(self, counts):
        """In encoder mode: the shaft has turned by ``counts``."""
        if self.encoder and self.running:
            memory.poke(self.at + CNT, (memory.words[self.at + CNT] + counts) % self.modulus)
