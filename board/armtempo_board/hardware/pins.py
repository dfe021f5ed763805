"""Pins, timers and DMA streams of the board (STM32F4DISC): the only home of these facts.

Free of USB, SWD, REPL and LEDs. Streams: RM0090 10.3.3; alternate functions: STM32F407
data sheet, table 9.
"""

from micropython import const

_PORTS = "ABCDE"
_PORT_SHIFT = const(4)
_LINE_MASK = const(15)
_LETTER = const(1)  # of the port, in front of the number
STEP = (
    # STEP pin, timer, its channel, alternate function, DMA1 stream, DMA channel
    ("A15", 2, 1, 1, 5, 3),
    ("A1", 2, 2, 1, 6, 3),
    ("B10", 2, 3, 1, 1, 3),
    ("A2", 5, 3, 2, 0, 6),
    ("A3", 5, 4, 2, 3, 6),
    ("A0", 5, 1, 2, 2, 6),  # takes the replay button's pin
)
DIR = ("E7", "E8", "E10", "E13", "E14", "E6")
ENCODER = (
    # timer, its channel 1 pin, its channel 2 pin, alternate function
    (1, "E9", "E11", 1),
    (3, "B4", "B5", 2),
    (8, "C6", "C7", 3),
    (4, "B6", "B7", 2),
)
ENABLE = "E12"
ESTOP = "E15"
LIMIT = ("D8", "D9", "D10")
BUTTON = "A0"  # not together with the STEP of channel 6
LEDS = ("D12", "D13", "D14", "D15")  # green, orange, red, blue


def name(number: int) -> str:
    """A pin by its number in the arm record, 16 times its port and the number in it; "" if there is none."""
    port = number >> _PORT_SHIFT
    return _PORTS[port] + str(number & _LINE_MASK) if port < len(_PORTS) else ""


def port(pin: str) -> str:
    """The letter of a pin's port."""
    return pin[:_LETTER]


def line(pin: str) -> int:
    """The number of a pin in its port, and of its external interrupt line."""
    return int(pin[_LETTER:])
