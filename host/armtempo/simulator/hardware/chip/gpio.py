"""GPIO ports: pins driven by the program or a timer, pins read by the program (RM0090 chapter 8)."""

from chip import memory

MODER, OTYPER, OSPEEDR, PUPDR, IDR, ODR, BSRR = range(7)
AFR = 8
AT_RESET = (
    # JTAG pins; PA13, PA15 and PB4 are pulled up (8.4.1, 8.4.4)
    ("GPIOA", MODER, 0xA8000000), ("GPIOA", PUPDR, 0x64000000),
    ("GPIOB", MODER, 0x280), ("GPIOB", PUPDR, 0x100),
)  # fmt: skip
PORTS = "ABCDE"
# alternate functions of timers on the pins: (pin, function): (timer, channel); data sheet DS8626 table 9
TIMER_PINS = {
    ("A15", 1): (2, 1), ("A5", 1): (2, 1), ("A0", 1): (2, 1), ("A1", 1): (2, 2), ("B3", 1): (2, 2),
    ("A2", 1): (2, 3), ("B10", 1): (2, 3), ("A3", 1): (2, 4), ("B11", 1): (2, 4),
    ("A0", 2): (5, 1), ("A1", 2): (5, 2), ("A2", 2): (5, 3), ("A3", 2): (5, 4),
    ("E9", 1): (1, 1), ("E11", 1): (1, 2), ("A8", 1): (1, 1), ("A9", 1): (1, 2),
    ("A6", 2): (3, 1), ("A7", 2): (3, 2), ("B4", 2): (3, 1), ("B5", 2): (3, 2),
    ("C6", 2): (3, 1), ("C7", 2): (3, 2),
    ("B6", 2): (4, 1), ("B7", 2): (4, 2), ("D12", 2): (4, 1), ("D13", 2): (4, 2),
    ("C6", 3): (8, 1), ("C7", 3): (8, 2), ("C8", 3): (8, 3), ("C9", 3): (8, 4),
    ("E13", 1): (1, 3), ("E14", 1): (1, 4), ("A10", 1): (1, 3),
    ("B0", 2): (3, 3), ("B1", 2): (3, 4), ("C8", 2): (3, 3), ("C9", 2): (3, 4),
    ("B8", 2): (4, 3), ("B9", 2): (4, 4), ("D14", 2): (4, 3), ("D15", 2): (4, 4),
    ("A2", 3): (9, 1), ("A3", 3): (9, 2), ("E5", 3): (9, 1), ("E6", 3): (9, 2),
    ("B8", 3): (10, 1), ("B9", 3): (11, 1), ("B14", 9): (12, 1), ("B15", 9): (12, 2),
    ("A6", 9): (13, 1), ("A7", 9): (14, 1),
}  # fmt: skip
INPUT, OUTPUT, ALTERNATE, ANALOG = range(4)


class Line:
    """One pin: the level driven from outside, its output level, and the receivers of its edges."""

    def __init__(self, port, number):
        self.port = port
        self.number = number
        self.name = PORTS[port.index] + str(number)
        self.external = None
        self.driven = False  # by a timer channel
        self.is_dead = False  # injected faults: it does not toggle,
        self.tied_to = None  # or another one toggles with it
        self.level = 0
        self.pulses = (0, 0)
        self.sinks = []
        self.pulse_sinks = []

    def mode(self):
        """INPUT, OUTPUT, ALTERNATE or ANALOG."""
        return (memory.words[self.port.at + MODER] >> (2 * self.number)) & 3

    def alternate(self):
        """The selected alternate function."""
        word = memory.words[self.port.at + AFR + (self.number >> 3)]
        return (word >> (4 * (self.number & 7))) & 15

    def timer(self):
        """(timer, channel) that the pin's alternate function selects, or None."""
        if self.mode() != ALTERNATE:
            return None
        return TIMER_PINS.get((self.name, self.alternate()))

    def read(self):
        """Level that the program reads: driven from outside, by the pull resistor, or by its own output."""
        if self.mode() == OUTPUT or self.driven:
            return self.level
        if self.external is not None:
            return self.external
        return 1 if (memory.words[self.port.at + PUPDR] >> (2 * self.number)) & 3 == 1 else 0

    def edges(self, before, count, times, origin):
        """The pin toggled ``count`` times from level ``before``, at ``origin`` + each of ``times`` ticks."""
        if self.is_dead:
            return
        if self.tied_to:
            self.tied_to.edges(before, count, times, origin)
        self.level = before ^ (count & 1)
        at = self.port.at + IDR
        memory.poke(at, memory.words[at] & ~(1 << self.number) | self.level << self.number)
        for sink in self.sinks:
            sink.edges(self, before, count, times, origin)

    def pulse(self, pulses, now):
        """PWM begins: (ticks high, ticks of the period); (0, 0): it ends."""
        self.pulses = pulses
        for sink in self.pulse_sinks:
            sink.pulses(self, pulses, now)


class GpioPort:
    """One GPIO port."""

    def __init__(self, index):
        self.index = index
        self.at = memory.index("GPIO" + PORTS[index])
        self.lines = [Line(self, number) for number in range(16)]
        self.routing = None

    def sync(self, now):
        """The program may have written the port's registers; True if a pin's function changed."""
        written = memory.words[self.at + BSRR]
        if written:
            odr = memory.words[self.at + ODR] & ~(written >> 16) | written & 0xFFFF
            memory.poke(self.at + ODR, odr & 0xFFFF)
            memory.poke(self.at + BSRR, 0)
        self._drive(now)
        routing = tuple(memory.words[self.at + at] for at in (MODER, AFR, AFR + 1))
        changed = routing != self.routing
        if changed:
            self._end_pulses(now)
        self.routing = routing
        self.refresh()
        return changed

    def _end_pulses(self, now):
        """End the PWM of a pin that no timer drives any more."""
        for line in self.lines:
            if line.pulses != (0, 0) and line.mode() != ALTERNATE:
                line.pulse((0, 0), now)

    def _drive(self, now):
        modes = memory.words[self.at + MODER]
        odr = memory.words[self.at + ODR]
        for line in self.lines:
            if (modes >> (2 * line.number)) & 3 == OUTPUT:
                level = (odr >> line.number) & 1
                if level != line.level:
                    line.edges(line.level, 1, (now,), 0)

    def refresh(self):
        """Update IDR."""
        levels = 0
        for line in self.lines:
            levels |= line.read() << line.number
        memory.poke(self.at + IDR, levels)


class Pins:
    """All ports, and the pins of each timer channel."""

    def __init__(self):
        self.ports = [GpioPort(index) for index in range(len(PORTS))]

    def line(self, name):
        """A pin by its name, with or without the leading P: ``PA15``."""
        if name[0] == "P":
            name = name[1:]
        return self.ports[PORTS.index(name[0])].lines[int(name[1:])]

    def of_channel(self, timer, channel):
        """The pins that a timer's channel drives."""
        lines = [line for port in self.ports for line in port.lines if line.mode() == ALTERNATE]
        return [line for line in lines if line.timer() == (timer, channel)]

    def route(self, timers):
        """Connect the timers' channels to the pins whose alternate functions select them."""
        for timer in timers:
            for channel in timer.channels:
                channel.sink = None
        for port in self.ports:
            for line in port.lines:
                line.driven = False
                target = line.timer()
                for timer in timers:
                    if target and target[0] == timer.number:
                        timer.channels[target[1] - 1].sink = line
                        line.driven = True
