"""The board program as a folder from which MicroPython's own build makes it a part of the firmware."""

from __future__ import annotations

from pathlib import Path

from armtempo.boardfiles import PACKAGES, own_crc
from armtempo.deploy import package, program
from armtempo.errors import LinkError

MANIFEST = "manifest.py"
_OPTIMISED = 3
"""As in compiled files: no assertions, no line numbers."""
_HASH_MODULE = f"{PACKAGES[1]}/program.py"
"""On a board with files it takes the hash from them; in the firmware there are none."""


def write(folder: Path) -> None:
    """Write the library's sources and a manifest for MicroPython's FROZEN_MANIFEST into a new or empty folder.

    Raises InputError where it holds something already or cannot be written.
    """
    sources = {name: path.read_bytes() for name, path in program.modules().items()}
    made = {_HASH_MODULE: _hash_module(), MANIFEST: _manifest()}
    package.fill(folder, {**sources, **{name: text.encode() for name, text in made.items()}})


def check_version(firmware_crc: int | None) -> None:
    """LinkError where a board's firmware has another version of the program; None: it has none."""
    if firmware_crc not in (None, own_crc()):
        raise LinkError(
            f"the board's firmware has another version of the program built in ({firmware_crc:08x}, here "
            f"{own_crc():08x}), and files in the flash do not replace it: build the firmware anew "
            "('armtempo deploy --firmware FOLDER', board/docs/firmware.md) or flash the one of MicroPython, "
            "then deploy again"
        )


def _manifest() -> str:
    """The packages beside it, and what the board's own manifest has."""
    lines = [f'package("{name}", opt={_OPTIMISED})' for name in PACKAGES]
    return "\n".join(['include("$(PORT_DIR)/boards/manifest.py")', *lines, ""])


def _hash_module() -> str:
    """Stands in the firmware for the module that makes the hash of a program that lies in files."""
    return f'''"""The hash of the program in this firmware, by which host and board compare what each has."""

FIRMWARE_CRC = 0x{own_crc():08X}


def program_crc(board, shared):
    """The hash; there are no files."""
    return FIRMWARE_CRC
'''
