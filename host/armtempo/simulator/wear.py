"""Erasures of a virtual board's flash, by sector."""

from __future__ import annotations

import json
import os
import tempfile
from pathlib import Path

from armtempo.ports.names import is_sim, sim_flash
from armtempo.simulator.launcher import FLASH_OF, PREFIX

SUFFIX = ".erasures"
"""Of the file next to the flash's folder, as in ``hardware/chip/flash.py``."""


def erasures(port: str) -> dict[str, int]:
    """Erasures of each sector of the virtual board on a port; empty if nothing was erased, or it is not known."""
    flash = _flash_of(port)
    if flash is None:
        return {}
    try:
        return {str(sector): int(count) for sector, count in json.loads(_beside(flash).read_text()).items()}
    except (OSError, ValueError, AttributeError):
        return {}


def _beside(flash: Path) -> Path:
    return flash.with_name(flash.name + SUFFIX)


def _flash_of(port: str) -> Path | None:
    if is_sim(port):
        found = sim_flash(port)
        return None if found is None else found.resolve()
    name = FLASH_OF + os.path.basename(os.path.realpath(port))
    return next((link.resolve() for link in Path(tempfile.gettempdir()).glob(f"{PREFIX}*/{name}")), None)
