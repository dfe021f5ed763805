"""MicroPython's ``pyb`` of the STM32F4DISC board, as far as the board program uses it."""

import machine_state
from firmware.external_interrupts import ExtInt
from firmware.pin_api import Pin
from firmware.timer_api import Timer, TimerChannel  # noqa: F401
from firmware.usb_serial import USB_VCP
from machine import disable_irq, enable_irq, freq, unique_id  # noqa: F401
from machine import idle as wfi  # noqa: F401
from machine import reset as hard_reset  # noqa: F401

_LED_PINS = ("PD14", "PD12", "PD13", "PD15")


class LED:
    """1 red, 2 green, 3 orange, 4 blue."""

    def __init__(self, number):
        self._pin = Pin(_LED_PINS[number - 1], Pin.OUT_PP)

    def on(self):
        """Light it."""
        self._pin.high()

    def off(self):
        """Darken it."""
        self._pin.low()

    def toggle(self):
        """Change it."""
        self._pin.value(1 - self._pin.value())


class Switch:
    """The user button on PA0; pressed is high."""

    def __init__(self):
        self._pin = Pin("PA0", Pin.IN)

    def value(self):
        """Whether it is pressed."""
        return bool(self._pin.value())

    __call__ = value

    def callback(self, function):
        """Call ``function()`` when it is pressed."""
        callback = function and (lambda line: function())
        ExtInt(self._pin, ExtInt.IRQ_RISING, Pin.PULL_NONE, callback)


class Flash:
    """The flash as a block device, for ``os.mount`` and ``os.VfsFat.mkfs``."""

    def __init__(self, *, start=-1, len=-1):
        """There is one file system, in all of it."""


def usb_mode(mode=None, *args, **kwargs):
    """Read or set what the USB port shows itself as."""
    if mode is None:
        return machine_state.settings.get("usb_mode", "VCP+MSC")
    machine_state.settings["usb_mode"] = mode
    return None


def main(name):
    """Which file is run after ``boot.py``."""
    machine_state.settings["main"] = name


def have_cdc():
    """Whether a host has the serial port open."""
    return USB_VCP().isconnected()


def millis():
    """Milliseconds since power-up."""
    return machine_state.pace.milliseconds()


def delay(ms):
    """Wait."""
    machine_state.pace.sleep_us(1000 * ms)


def udelay(us):
    """Wait."""
    machine_state.pace.sleep_us(us)


def country(code=None):
    """Nothing to set."""


def fault_debug(value):
    """Nothing to set: a fault of the virtual processor is a traceback."""
