"""What a virtual board is started with; handed to its process as one JSON file."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Fault:
    """Something that goes wrong ``at_s`` seconds into the ``run``-th motion since power-up.

    ``kind``: ``stall`` (the main loop loses ``ms``), ``input`` (the pin ``name`` gets ``level`` 0 or 1),
    ``block`` (the joint ``joint``, counted from 0, cannot turn any more), ``slip`` (its encoder is turned by
    ``counts``), ``silence`` (the serial cable is out for ``ms``), ``hang`` (the program stops for ever) or
    ``crash`` (the next look at the time raises).
    """

    kind: str
    at_s: float
    run: int = 1
    ms: float = 0.0
    name: str = ""
    level: int = 0
    joint: int = 0
    counts: int = 0


@dataclass(frozen=True)
class Options:
    """The options of ``main.py``. Paths are absolute."""

    flash: str
    """Folder that is the board's ``/flash``."""
    sources: list[str]
    """Folders with the packages of the board program: how its pins are wired, what an arm record says."""
    program: list[str]
    """Folders with the board's packages, as if they were deployed; empty: only what the flash has."""
    flash_blocks: int = 190
    """Size of the flash: what an STM32F4DISC's file system has for files."""
    speed: float = 0.0
    """Motions run at this multiple of real time; 0: as fast as they can."""
    edge_log: str | None = None
    """File that gets every pin edge; read it with ``armtempo.simulator.edgelog``."""
    unique_id: str = "000000000000000000000000"
    """24 hex digits."""
    dma_preload: bool = True
    """DMA streams fetch one word ahead, as the chip's do in direct mode (RM0090 10.3.12)."""
    power_cut_at: int = 0
    """The power fails during this flash operation, counted from 1; 0: never."""
    button_ms: float = 0.0
    """The user button is held for so long from power-up on."""
    sd_card: str | None = None
    """Folder that is an SD card in the board's slot."""
    damage: str = ""
    """What the flash has suffered: a kind of ``hardware/simulator/flash.py``."""
    machine: str = "STM32F4DISC with STM32F407"
    """What the firmware says it was built for."""
    turn_us: int = 1000
    """What a turn of the program's main loop takes on the chip beyond its simulated calls."""
    arm: dict[str, Any] | None = None
    """Motors and encoders on the pins; None: ideal ones for the arm record in the flash."""
    up: str = ""
    """File that is made when the program has started."""
    seed: int = 0
    faults: list[Fault] = field(default_factory=list)

    def write(self, path: Path) -> None:
        """Write them for ``main.py``."""
        path.write_text(json.dumps(asdict(self)))


def unique_id(seed: int) -> str:
    """A board's 24 hex digits, another for each seed."""
    return hashlib.sha256(b"virtual board %d" % seed).hexdigest()[:24]
