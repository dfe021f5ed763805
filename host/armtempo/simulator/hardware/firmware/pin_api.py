"""``pyb.Pin`` (which is also ``machine.Pin``) on the simulated ports."""

import machine_state
from chip import gpio, memory

_PULL_NONE, _PULL_UP, _PULL_DOWN = 0, 1, 2


class Pin:
    """One pin; arguments as in MicroPython."""

    IN, OUT_PP, OUT_OD, AF_PP, AF_OD, ANALOG = 0, 1, 0x11, 2, 0x12, 3
    OUT, ALT, OPEN_DRAIN, ALT_OPEN_DRAIN = OUT_PP, AF_PP, OUT_OD, AF_OD
    PULL_NONE, PULL_UP, PULL_DOWN = _PULL_NONE, _PULL_UP, _PULL_DOWN
    IRQ_RISING, IRQ_FALLING = 0x10110000, 0x10210000
    AF1_TIM1 = AF1_TIM2 = 1
    AF2_TIM3 = AF2_TIM4 = AF2_TIM5 = 2
    AF3_TIM8 = 3

    def __init__(self, name, mode=None, pull=_PULL_NONE, value=None, alt=-1, af=-1):
        if isinstance(name, Pin):
            name = name.name()
        try:
            self.line = machine_state.board.pins.line(name)
        except (ValueError, IndexError, TypeError):
            raise ValueError("Pin(%r) doesn't exist" % name)
        if mode is not None:
            self.init(mode, pull, value, alt, af)

    def init(self, mode, pull=_PULL_NONE, value=None, alt=-1, af=-1):
        """Set mode, pull and alternate function."""
        number, at = self.line.number, self.line.port.at
        if mode & 3 == gpio.ALTERNATE:
            _field(at + gpio.AFR + (number >> 3), 4, number & 7, alt if alt >= 0 else af)
        if value is not None:
            _field(at + gpio.ODR, 1, number, 1 if value else 0)
        _field(at + gpio.PUPDR, 2, number, pull or 0)
        _field(at + gpio.OTYPER, 1, number, mode >> 4)
        _field(at + gpio.MODER, 2, number, mode & 3)
        machine_state.board.wrote()

    def value(self, level=None):
        """Read the pin, or drive it."""
        if level is None:
            machine_state.board.call()
            return self.line.read()
        _field(self.line.port.at + gpio.ODR, 1, self.line.number, 1 if level else 0)
        machine_state.board.wrote()
        return None

    __call__ = value

    def high(self):
        self.value(1)

    def low(self):
        self.value(0)

    on = high
    off = low

    def name(self):
        """Port letter and number."""
        return self.line.name

    def pin(self):
        """Number in its port."""
        return self.line.number

    def port(self):
        """Number of its port, A = 0."""
        return self.line.port.index

    def gpio(self):
        """Address of its port's registers."""
        return memory.address("GPIO" + gpio.PORTS[self.line.port.index])

    def mode(self):
        return self.line.mode()

    def af(self):
        return self.line.alternate()


def _field(at, bits, number, value):
    """Write field ``number`` of ``bits`` bits in a register."""
    mask = (1 << bits) - 1
    memory.words[at] = memory.words[at] & ~(mask << bits * number) | (value & mask) << bits * number
