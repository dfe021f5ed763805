"""The chip: virtual time and interrupts.

Time is in ticks of the 84 MHz clock since power-up. It passes only in calls of simulated functions, each of which takes
about as long as on the chip. ``run_until`` advances the models to a time and serves interrupts on the way, with
the chip's latency.
"""

import sys

from machine_state import PowerOff, Reset

from chip import capture, dma, gpio, memory, timers

TICKS_PER_MS = 84_000
TICKS_PER_US = 84
CALL_TICKS = 84
"""Time of a simulated call or register access: 1 us, about 130 instructions of the interpreter."""
FLASH_ACR = 0x705
"""The firmware's setting: 5 wait states, prefetch and both caches on (RM0090 3.9.1)."""
_MOST_UNSPENT_TICKS = 40 * CALL_TICKS
INTERRUPT_TICKS = 160
"""From an event to the first line of its callback: 1.9 us (instructions of an empty callback)."""
CALLBACK_TICKS = 250
"""Time of a callback in addition to its simulated calls."""
NEVER = timers.NEVER
_SWIER = 4  # word of EXTI
_RCC_TIMERS = {
    1: (17, 0), 8: (17, 1), 2: (16, 0), 3: (16, 1), 4: (16, 2), 5: (16, 3), 6: (16, 4), 7: (16, 5),
    9: (17, 16), 10: (17, 17), 11: (17, 18), 12: (16, 6), 13: (16, 7), 14: (16, 8),
}  # fmt: skip
_CYCLES_PER_TICK = 2  # 168 MHz, in ticks of 84 MHz
_CTRL, _CYCCNT = 0, 1  # words of DWT
_DEMCR = 63  # word of the block from 0xE000ED00 on
_TRCENA = 24


class CycleCounter:
    """The DWT cycle counter (ARMv7-M Architecture Reference Manual C1.8.8), enabled by its and the trace's bit.

    ``look`` updates the register before a read; ``sync`` handles a write.
    """

    def __init__(self, board):
        self._board = board
        self.at = memory.index("DWT") + _CYCCNT
        self._since = 0

    def _on(self):
        words = memory.words
        return words[self.at - _CYCCNT + _CTRL] & 1 and words[memory.index("SCS") + _DEMCR] >> _TRCENA & 1

    def look(self):
        """The register is about to be read."""
        self._board.spend(0)
        if self._on():
            passed = (self._board.now - self._since) * _CYCLES_PER_TICK
            memory.poke(self.at, (memory.words[self.at] + passed) & memory.MASK)
        self._since = self._board.now

    def sync(self):
        """The counter or its enable bits were written: count from the new value."""
        self._since = self._board.now


class Chip:
    """All peripherals, interrupts and the virtual time.

    ``observers`` are notified of starts and stops of timers and of changed inputs; ``follow()`` is called whenever
    time has passed.
    """

    def __init__(self, dma_preload=True):
        memory.clear()
        self.now = 0
        self.dma_preload = dma_preload
        self.dma = dma.Controller()
        self.pins = gpio.Pins()
        self.backup = memory.BackupSram()
        self.sectors = None
        self.cycles = CycleCounter(self)
        self.timers = {}
        for number, bits, rate in ((2, 32, 1), (5, 32, 1), (1, 16, 2), (8, 16, 2), (3, 16, 1), (4, 16, 1),
                                   (6, 16, 1), (7, 16, 1), (9, 16, 2), (10, 16, 2), (11, 16, 2),
                                   (12, 16, 1), (13, 16, 1), (14, 16, 1)):  # fmt: skip
            self.timers[number] = timers.TimerUnit(self, number, bits, rate)
        self.timers[2].follower = self.timers[5]
        self.reader = capture.PortReader(self)
        self.counting = []
        self.pending = []
        self.masked = False
        self.serving = False
        self.woken = False
        self.next_event = 0
        self.events = []
        self.callbacks = {}
        self.scheduled = []
        self.interrupted = False
        self.api = {}
        self.extints = {}
        self.observers = []
        self.follow = None
        self.unspent_ticks = 0
        self.lost_ticks = 0
        self.crash = False
        self.late_ticks = 0  # an injected fault: additional interrupt latency
        self.watchdog_ticks = 0
        self.watchdog_deadline = None
        self.millisecond = None
        self.next_ms = TICKS_PER_MS
        memory.poke(memory.index("IWDG") + 2, 0xFFF)
        memory.poke(memory.index("FLASH"), FLASH_ACR)
        for port, register, value in gpio.AT_RESET:
            memory.poke(memory.index(port) + register, value)
        self.sync(True)

    # -- what the program wrote ------------------------------------------------------------------

    def sync(self, everything=False):
        """Handle the registers that the program has written since the last call."""
        blocks = range(len(memory.BLOCKS)) if everything else memory.changed_blocks()
        if not self.backup.is_open:
            self.backup.undo()
        if not blocks:
            return
        names = [memory.BLOCKS[block] for block in blocks]
        if "RCC" in names:
            names = memory.BLOCKS
        self._sync_pins(names)
        if "PWR" in names:
            self.backup.sync()
        if "RTC" in names:
            self.backup.sync_rtc()
        if "DWT" in names or "SCS" in names:
            self.cycles.sync()
        if "FLASH" in names and self.sectors:
            self.sectors.sync()
        if "DMA1" in names or "RCC" in names:
            rcc = memory.words[memory.index("RCC") + 12]
            self.dma.sync((rcc >> 21) & 1)
        for number, timer in self.timers.items():
            if "DMA1" in names or "TIM%d" % number in names:
                register, bit = _RCC_TIMERS[number]
                timer.clocked = bool(memory.words[memory.index("RCC") + register] >> bit & 1)
                timer.sync(self.now)
        if "DMA2" in names or "TIM1" in names:
            self.reader.sync()
        if "EXTI" in names:
            self._sync_triggers()
        for block in blocks:
            memory.accept(block)
        self._find_event()

    def _sync_pins(self, names):
        routed = False
        for port in self.pins.ports:
            if "GPIO" + gpio.PORTS[port.index] in names:
                routed = port.sync(self.now) or routed
                for extint in self.extints.values():
                    extint.look()  # its pull resistor may have changed
        if routed:
            self.pins.route((self.timers[2], self.timers[5]))

    def _sync_triggers(self):
        """EXTI was written: a bit of SWIER requests the line's interrupt (RM0090 12.3.5)."""
        at = memory.index("EXTI") + _SWIER
        asked = memory.words[at]
        if asked:
            memory.poke(at, 0)  # as the handler's clearing of the pending bit does
            for line, extint in self.extints.items():
                if asked >> line & 1 and extint.enabled:
                    self.pend("exti", line)

    def recount(self):
        """A timer was started or stopped: list the timers that count by a clock."""
        self.counting = [timer for timer in self.timers.values() if timer.counts_by_clock()]

    # -- time ------------------------------------------------------------------------------------

    def at(self, tick, action):
        """Call ``action()`` at ``tick``."""
        self.events.append((tick, action))
        self.events.sort(key=lambda event: event[0])
        self._find_event()

    def _find_event(self):
        due = self.events[0][0] if self.events else NEVER
        for timer in self.counting:
            due = min(due, timer.next_interrupt())
        self.next_event = due

    def call(self):
        """The program made a short call; the time of several is spent together."""
        self.unspent_ticks += CALL_TICKS
        if self.unspent_ticks > _MOST_UNSPENT_TICKS:
            self.spend(0)

    def wrote(self):
        """The program wrote a register, which takes effect at once."""
        self.sync()
        self.call()

    def spend(self, ticks):
        """The program takes ``ticks``."""
        ticks += self.unspent_ticks
        self.unspent_ticks = 0
        self.run_until(self.now + ticks)

    def run_until(self, target, wake=False):
        """Let time pass to ``target``; with ``wake``, at most until an interrupt has been served."""
        self._pass(target, wake)
        if not self.serving:
            self._between()

    def _between(self):
        """Between two steps of the main program: faults, the millisecond."""
        if self.lost_ticks:
            lost, self.lost_ticks = self.lost_ticks, 0
            self._pass(self.now + lost, False)
        if self.now >= self.next_ms and self.millisecond:
            self.next_ms = (self.now // TICKS_PER_MS + 1) * TICKS_PER_MS
            self.millisecond()

    def _pass(self, target, wake):
        self.sync()
        self.woken = False
        self._serve()
        while self.next_event <= target and not (wake and self.woken):
            self._run(max(self.next_event, self.now))
            while self.events and self.events[0][0] <= self.now:
                self.events.pop(0)[1]()
            self._find_event()
            self._serve()
        if target > self.now and not (wake and self.woken):
            self._run(target)

    def stall(self, ticks):
        """The processor halts for ``ticks``, and serves no interrupt."""
        self.sync()
        self._run(self.now + ticks)

    def _run(self, target):
        """Run the hardware alone to ``target``."""
        for timer in self.counting:
            timer.run(target)
        self.now = target
        if self.reader.streams:
            self.reader.run(target)
        if self.follow:
            self.follow()

    def moving(self, horizon_ticks):
        """Whether a timer has an event within ``horizon_ticks``."""
        limit = self.now + horizon_ticks
        return any([timer.next_match() < limit for timer in self.counting])

    def input_changed(self, line, level):
        """The level of an input pin was changed from outside."""
        for observer in self.observers:
            observer.input_changed(line, level, self.now)

    # -- interrupts ------------------------------------------------------------------------------

    def pend(self, source, detail):
        """Request an interrupt."""
        if (source, detail) not in self.pending:
            self.pending.append((source, detail))

    def schedule(self, function, argument):
        """Call ``function(argument)`` soon, outside of interrupts; at most eight wait (MICROPY_SCHEDULER_DEPTH)."""
        if len(self.scheduled) >= 8:
            raise RuntimeError("schedule queue full")
        self.scheduled.append((function, argument))

    def _serve(self):
        if self.serving or self.masked:
            return
        while self.scheduled:
            function, argument = self.scheduled.pop(0)
            self._call(function, argument, "scheduled function")
        while self.pending and not self.masked:
            source, detail = self.pending.pop(0)
            callback = self.callbacks.get((source, detail))
            if callback:
                self._interrupt(source, detail, *callback)

    def _interrupt(self, source, detail, function, argument):
        self.serving = True
        self.woken = True
        self._run(self.now + INTERRUPT_TICKS + self.late_ticks)
        if source in self.timers:
            self.timers[source].acknowledge(detail)
        if not self._call(function, argument, "interrupt handler"):
            del self.callbacks[(source, detail)]  # as the firmware does
        self.sync()
        self._run(self.now + CALLBACK_TICKS)
        self.serving = False
        self._find_event()

    def _call(self, function, argument, what):
        """Call it, and print what it raises, as the firmware does; returns whether it ended well."""
        try:
            function(argument)
        except (Reset, PowerOff):
            raise
        except BaseException as error:
            sys.stderr.write("uncaught exception in %s\n" % what)
            print_exception(error)
            return False
        return True


def print_exception(error):
    """Traceback to stderr, on either interpreter."""
    if hasattr(sys, "print_exception"):
        sys.print_exception(error, sys.stderr)
    else:
        sys.excepthook(type(error), error, error.__traceback__)
