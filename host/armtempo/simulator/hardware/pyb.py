"""The part of the STM32F4DISC's ``pyb`` that the board program uses."""

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
    """LED 1 red, 2 green, 3 orange, 4 blue."""

    def __init__(self, number):
        self._pin = Pin(_LED_PINS[number - 1], Pin.OUT_PP)

    def on(self):
        self._pin.high()

    def off(self):
        self._pin.low()

    def toggle(self):
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
        """The file system fills the flash, whatever the arguments."""


def usb_mode(mode=None, *args, **kwargs):
    """Read or set the USB mode."""
    if mode is None:
        return machine_state.settings.get("usb_mode", "VCP+MSC")
    machine_state.settings["usb_mode"] = mode
    return None


def main(name):
    """Set the file that is run after ``boot.py``."""
    machine_state.settings["main"] = name


def have_cdc():
    """Whether a host has the serial port open."""
    return USB_VCP().isconnected()


def millis():
    """Milliseconds since power-up."""
    return machine_state.pace.milliseconds()


def delay(ms):
    machine_state.pace.sleep_us(1000 * ms)


def udelay(us):
    machine_state.pace.sleep_us(us)


def country(code=None):
    """Does nothing: of the network."""


def fault_debug(value):
    """Does nothing: a fault of the virtual processor is a traceback."""
