"""The port to use if none is given."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from armtempo.basics.errors import InputError
from armtempo.basics.settings import PORT, ProjectSettings, Setting, missing_setting
from armtempo.ports import claim
from armtempo.ports.caller import Ownership, ownership
from armtempo.ports.names import SIM

_VENDOR = 0xF055
_PRODUCTS = range(0x9800, 0x980B)
"""USB ids of MicroPython on an STM32 (its ports/stm32/mpconfigboard_common.h)."""
ONLY_BOARD = "the only board plugged in"
ONLY_OPEN = "the only port that an armtempo program has open"
UNASKED = (ONLY_BOARD, ONLY_OPEN)
"""Sources of a default port; such a choice is printed."""


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


def choose(given: str | None = None, others: bool = False) -> Setting:
    """The port to use, and its source: ``given``, the variable, the project folder, else the only likely board.

    ``others``: also accept the only port that another armtempo program has open, for commands that work
    through that program. Raises InputError if there is no port, or more than one.
    """
    found = ProjectSettings().get(PORT, given)
    if found:
        return found
    candidates = _open_ports() if others else []
    why = ONLY_OPEN
    if not candidates:
        candidates = [port.device for port in find_ports() if port.board]
        why = ONLY_BOARD
    if len(candidates) == 1:
        return Setting(PORT, candidates[0], why)
    raise _unclear(candidates)


def _open_ports() -> list[str]:
    lives = [one for one in claim.claims() if ownership(one) is not Ownership.DEAD]
    return sorted({one.port for one in lives})


def _unclear(candidates: list[str]) -> InputError:
    seen = (
        f"{len(candidates)} could be meant: {', '.join(candidates)}"
        if candidates
        else "none is plugged in ('armtempo ports' lists the ports)"
    )
    return missing_setting(PORT, f"which board? {seen}. '--port {SIM}' is a virtual one; for a real one")
