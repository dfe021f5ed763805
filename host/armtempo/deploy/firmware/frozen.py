"""The board program as a folder from which MicroPython's own build makes it a part of the firmware.

The sources go in as they are, but with constants in the place of their names (``constants.py``), which would take
eight kilobytes of the heap: with the six joints of AR4 22 032 bytes were free after a first program, with three after a
sequence 18 080, and the example of host/docs/programs.md needs 22 104 (host/docs/measurements.md). Machine code, byte
code, names and line numbers stay in the flash.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path

from armtempo.basics.errors import InputError
from armtempo.deploy import program_files
from armtempo.deploy.constants import fold
from armtempo.link.program_version import PACKAGES, own_crc

MANIFEST = "manifest.py"
USUAL_MANIFEST = "$(PORT_DIR)/boards/manifest.py"
"""What is frozen into most boards of MicroPython's stm32 port."""
HASH = f"{PACKAGES[1]}/firmware.py"
"""Module of the shared package that only a firmware has."""
_HASH_MODULE = f'''"""The hash of the program in this firmware, by which host and board compare theirs."""


def program_crc(board, shared):
    """The hash; the arguments are for programs in files."""
    from {PACKAGES[1]}.firmware import CRC

    return CRC
'''
"""Replaces the shared package's module that computes the hash from files."""


def write(folder: Path, board_manifest: str = USUAL_MANIFEST) -> None:
    """Write the program's sources and a manifest for MicroPython's FROZEN_MANIFEST into a new or empty folder.

    ``board_manifest``: what else is frozen. Raises InputError if the folder holds something already or
    cannot be written.
    """
    fill(folder, files(board_manifest))


def files(board_manifest: str = USUAL_MANIFEST) -> dict[str, bytes]:
    """The folder's files by their path in it."""
    texts = _folded()
    sources = {name: texts[program_files.dotted(name)].encode() for name in program_files.modules()}
    manifest = Path(__file__).with_name(MANIFEST).read_text(encoding="utf-8")
    made = {
        f"{PACKAGES[1]}/program_hash.py": _HASH_MODULE,
        HASH: f"CRC = 0x{own_crc():08X}\n",
        MANIFEST: manifest.replace(USUAL_MANIFEST, board_manifest),
    }
    return sources | {name: text.encode() for name, text in made.items()}


@cache
def _folded() -> dict[str, str]:
    """The sources with constants in the place of their names: it takes seconds."""
    return fold(program_files.sources())


def fill(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write files by their path below a new or empty folder; raises as ``write``."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if any(folder.iterdir()):
            raise InputError(f"{folder} is not empty", "name a new folder")
        for name, data in files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(data)
    except OSError as error:
        raise InputError(
            f"{folder} cannot be written: {error.strerror}",
            "choose a folder that may be written",
        ) from error
