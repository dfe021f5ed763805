"""Pins, timers and interrupts that only remember what they were told."""


class Pin:
    """A pin."""

    IN, OUT_PP, AF_PP, PULL_NONE, PULL_UP, PULL_DOWN = range(6)

    def __init__(self, name, mode=0, pull=0, value=0, alt=0):
        self.level = value

    def value(self, level=None):
        """Read or drive it."""
        if level is None:
            return self.level
        self.level = level
        return None

    def init(self, mode, pull=0, value=0):
        """Nothing to set."""


class ExtInt:
    """An external interrupt."""

    IRQ_RISING, IRQ_FALLING = 1, 2

    def __init__(self, pin, mode, pull, callback):
        pass


class Timer:
    """A timer."""

    OC_TIMING = 1
    PWM = 0
    callbacks = {}

    def __init__(self, number, prescaler=0, period=0, freq=0, callback=None):
        self._number = number
        if callback:
            Timer.callbacks[number, 0] = callback

    def channel(self, number, mode, callback=None, pin=None, pulse_width=0):
        """Remember the callback; of pulses a channel that takes their width."""
        if mode == Timer.PWM:
            return Channel()
        Timer.callbacks[self._number, number] = callback
        return None

    def deinit(self):
        """Nothing to stop."""


class Channel:
    """A channel that makes pulses."""

    width = 0

    def pulse_width(self, width):
        """Remember it."""
        self.width = width
