"""Serial ports of this machine, and which have the USB ids of a board."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from serial.tools import list_ports
from serial.tools.list_ports_common import ListPortInfo

from armtempo.errors import InputError

SIM = "sim"
"""The port name that stands for a virtual board; ``sim:FOLDER`` for one whose flash is that folder."""
_VENDOR = 0xF055
_PRODUCTS = range(0x9800, 0x980B)
"""USB ids of MicroPython on an STM32 (its ports/stm32/mpconfigboard_common.h)."""


@dataclass(frozen=True)
class Port:
    """One serial port."""

    device: str
    description: str
    board: bool
    """Its USB ids are those of MicroPython on an STM32."""


def is_sim(port: str) -> bool:
    """Whether the port stands for a virtual board."""
    return port == SIM or port.startswith(SIM + ":")


def sim_flash(port: str) -> Path | None:
    """The folder that is the virtual board's flash; None: a new one that goes with the board.

    Raises InputError where the folder is not named.
    """
    if port == SIM:
        return None
    if port == SIM + ":":
        raise InputError(
            f"port '{port}' names no folder",
            "write sim:FOLDER to keep the flash there, or sim to keep it nowhere",
        )
    return Path(port[len(SIM) + 1 :])


def find_ports() -> list[Port]:
    """All serial ports, likely boards first."""
    found = [
        Port(info.device, _describe(info), info.vid == _VENDOR and info.pid in _PRODUCTS)
        for info in list_ports.comports()
    ]
    return sorted(found, key=lambda port: (not port.board, port.device))


def _describe(info: ListPortInfo) -> str:
    text = info.product or info.description or ""
    return "" if text == "n/a" else str(text)
