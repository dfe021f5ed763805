"""External interrupts (``pyb.ExtInt``), and input pins driven from outside."""

import machine_state
from chip.processor import CALL_TICKS

from firmware.pin_api import Pin

_RISING, _FALLING = 1, 2


def _nothing(_):
    """Callback of an edge that was pending when its own was removed."""


class ExtInt:
    """Calls ``callback(line)`` at an edge of a pin; there is one object for each line number."""

    IRQ_RISING, IRQ_FALLING, IRQ_RISING_FALLING = 0x10110000, 0x10210000, 0x10310000
    EVT_RISING, EVT_FALLING, EVT_RISING_FALLING = 0x10120000, 0x10220000, 0x10320000

    def __init__(self, pin, mode, pull, callback):
        if not isinstance(pin, Pin):
            pin = Pin(pin)
        pin.init(Pin.IN, pull)
        self._line = pin.line.number
        self._edges = (mode >> 20) & 3
        known = machine_state.board.extints.get(self._line)
        if known is not None and callback is not None and known.wired is not pin.line:
            raise ValueError("ExtInt vector %d is already in use" % self._line)
        self.wired = pin.line
        self._level = pin.line.read()
        self.enabled = callback is not None
        machine_state.board.extints[self._line] = self
        machine_state.board.callbacks[("exti", self._line)] = (callback or _nothing, self._line)
        machine_state.board.call()

    def line(self):
        return self._line

    def enable(self):
        self.enabled = True

    def disable(self):
        self.enabled = False

    def swint(self):
        """Trigger the callback by software."""
        machine_state.board.pend("exti", self._line)
        machine_state.board.spend(CALL_TICKS)

    def look(self):
        """The pin may have changed."""
        before, self._level = self._level, self.wired.read()
        if before != self._level and self.enabled and self._edges & (_RISING if self._level else _FALLING):
            machine_state.board.pend("exti", self._line)


def set_level(name, level):
    """Drive an input pin from outside with 0 or 1, or release it (None)."""
    line = machine_state.board.pins.line(name)
    before = line.read()
    line.external = level
    after = line.read()
    line.port.refresh()
    if before != after:
        machine_state.board.input_changed(line, after)
        extint = machine_state.board.extints.get(line.number)
        if extint is not None and extint.wired is line:
            extint.look()
