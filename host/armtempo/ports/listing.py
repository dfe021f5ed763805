"""The serial ports of this machine, and whether each has the USB ids of a board."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

_VENDOR = 0xF055
_PRODUCTS = range(0x9800, 0x980B)
"""USB ids of MicroPython on an STM32 (its ports/stm32/mpconfigboard_common.h)."""


@dataclass(frozen=True)
class Port:
    """One serial port."""

    device: str
    description: str
    board: bool
    """Whether its USB ids are those of MicroPython on an STM32."""


def find_ports() -> list[Port]:
    """All serial ports, likely boards first."""
    from serial.tools import list_ports  # imported here: it takes a while, and most commands get their port

    found = [
        Port(info.device, _describe(info), info.vid == _VENDOR and info.pid in _PRODUCTS)
        for info in list_ports.comports()
    ]
    return sorted(found, key=lambda port: (not port.board, port.device))


def _describe(info: Any) -> str:
    text = info.product or info.description or ""
    return "" if text == "n/a" else str(text)
