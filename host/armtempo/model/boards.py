"""The boards that an arm file can name: their pins, pins used by parts on the board, and timer outputs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

DEFAULT = "STM32F4DISC"
_PORTS = "ABCDE"


@dataclass(frozen=True)
class BoardPins:
    """The pins of a board; MicroPython's firmware for it has the same name."""

    name: str
    pins: frozenset[str]
    """Accessible pins of ports A to E, such as ``"PE9"``."""
    taken: Mapping[str, str]
    """Pins used by a part on the board, and that part."""


@dataclass(frozen=True)
class TimerOutput:
    """A channel of a timer at a pin."""

    timer: int
    channel: int

    @property
    def clock_hz(self) -> int:
        """The timer's clock before its prescaler, Hz (RM0090 6.2, at 168 MHz)."""
        return 168_000_000 if self.timer in (1, 8, 9, 10, 11) else 84_000_000


TIMER_OUTPUTS: dict[str, tuple[TimerOutput, ...]] = {
    pin: tuple(TimerOutput(*place) for place in places)
    for pin, places in {
        "PA2": ((9, 1),),
        "PA3": ((9, 2),),
        "PA6": ((13, 1), (3, 1)),
        "PA7": ((14, 1), (3, 2)),
        "PA8": ((1, 1),),
        "PB0": ((3, 3),),
        "PB1": ((3, 4),),
        "PB4": ((3, 1),),
        "PB5": ((3, 2),),
        "PB6": ((4, 1),),
        "PB7": ((4, 2),),
        "PB8": ((10, 1), (4, 3)),
        "PB9": ((11, 1), (4, 4)),
        "PB14": ((12, 1),),
        "PB15": ((12, 2),),
        "PC6": ((8, 1), (3, 1)),
        "PC7": ((8, 2), (3, 2)),
        "PC8": ((8, 3), (3, 3)),
        "PC9": ((8, 4), (3, 4)),
        "PE5": ((9, 1),),
        "PE6": ((9, 2),),
        "PE9": ((1, 1),),
        "PE11": ((1, 2),),
        "PE13": ((1, 3),),
        "PE14": ((1, 4),),
    }.items()
}
"""By pin, the timer with the fewest channels first (data sheet DS8626, table 9); TIM2 and TIM5 count steps."""


def pin_number(pin: str) -> int:
    """The number of a pin (``"PE9"``) in the arm record."""
    return 16 * (ord(pin[1]) - ord("A")) + int(pin[2:])


_USB = {
    "PA9": "USB (supply sensed)",
    "PA10": "USB (ID)",
    "PA11": "USB (data)",
    "PA12": "USB (data)",
}
_ALWAYS = {**_USB, "PA13": "the debugger", "PA14": "the debugger", "PB2": "the boot mode (BOOT1)"}
_CARD = dict.fromkeys(("PC8", "PC9", "PC10", "PC11", "PC12", "PD2"), "the SD card")
_CLOCK = {"PC14": "the clock crystal", "PC15": "the clock crystal"}


def _all_but(*missing: str) -> frozenset[str]:
    return frozenset(f"P{port}{number}" for port in _PORTS for number in range(16)) - frozenset(missing)


_64_PINS = frozenset([*(f"P{port}{number}" for port in "ABC" for number in range(16)), "PD2"])

BOARDS: dict[str, BoardPins] = {
    board.name: board
    for board in (
        BoardPins(
            "STM32F4DISC",
            _all_but("PB3"),
            {
                **_ALWAYS,
                **_CLOCK,
                "PC0": "the USB power switch",
                "PC3": "the microphone",
                "PD5": "the USB power switch",
                "PE0": "the accelerometer",
                "PE1": "the accelerometer",
            },
        ),
        BoardPins(
            "PYBV11",
            _64_PINS - {"PC14", "PC15"},
            {
                **_ALWAYS,
                **_CARD,
                "PA8": "the SD card",
                "PA13": "a LED",
                "PA14": "a LED",
                "PA15": "a LED",
                "PB2": "the accelerometer",
                "PB3": "the button",
                "PB4": "a LED",
                "PB5": "the accelerometer",
            },
        ),
        BoardPins(
            "VCC_GND_F407VE",
            _all_but(),
            {**_ALWAYS, **_CARD, **_CLOCK, "PA8": "the SD card", "PB9": "a LED"},
        ),
        BoardPins(
            "VCC_GND_F407ZG",
            _all_but(),
            {
                **_ALWAYS,
                **_CARD,
                **_CLOCK,
                **dict.fromkeys(("PA5", "PA6", "PA7", "PC4"), "the flash chip"),
            },
        ),
    )
}
"""By name. All run at 168 MHz."""
