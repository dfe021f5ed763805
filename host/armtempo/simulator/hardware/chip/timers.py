"""Timers: counting, update events, start by trigger, encoder mode (RM0090 chapters 17 and 18)."""

from chip import memory
from chip.compare import Channel
from chip.timer_registers import ARR, CNT, CR1, CR2, DIER, EGR, NEVER, PSC, SMCR, SR

_REBASE = 1 << 27


class TimerUnit:
    """One timer. ``total`` counts since ``origin`` (in ticks of 84 MHz); CNT follows from it."""

    def __init__(self, board, number, bits, rate=1):
        self.board = board
        self.number = number
        self.at = memory.index("TIM%d" % number)
        self.full = 1 << bits
        self.modulus = self.full
        self.rate = rate
        self.scale = 1
        self.divider = 1  # an injected fault: its clock is slower by this
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
        """CNT at a total count."""
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
        """Count on from ``count``, now."""
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
        """Whether time moves this counter."""
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
        """Keep the numbers small: 32-bit MicroPython puts those beyond 30 bits on its heap."""
        self.base = (self.base + total) % self.modulus
        self.origin += total
        self.total = 0
        for channel in self.channels:
            if channel.due != NEVER:
                channel.due -= total
        self._find_next()

    def acknowledge(self, flag):
        """The interrupt handler clears the flag before it calls back."""
        memory.poke(self.at + SR, memory.words[self.at + SR] & ~(1 << flag))

    def turn(self, counts):
        """In encoder mode: the shaft has turned by that many counts."""
        if self.encoder and self.running:
            memory.poke(self.at + CNT, (memory.words[self.at + CNT] + counts) % self.modulus)
