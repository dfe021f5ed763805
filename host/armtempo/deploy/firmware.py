"""The board program as a folder from which MicroPython's own build makes it a part of the firmware."""

from __future__ import annotations

from pathlib import Path

from armtempo.deploy import package, program_files
from armtempo.errors import LinkError
from armtempo.link.program_version import PACKAGES, own_crc

MANIFEST = "manifest.py"
_OPTIMISED = 3
"""As in compiled files: no assertions, no line numbers."""
_HASH = "firmware"
"""Module of the shared package that only a firmware has."""
_HASH_MODULE = f"""
def program_crc(board, shared):
    from {PACKAGES[1]}.{_HASH} import CRC

    return CRC
"""
"""Replaces the shared package's module that computes the hash from files."""


def write(folder: Path) -> None:
    """Write the program's sources and a manifest for MicroPython's FROZEN_MANIFEST into a new or empty folder.

    Raises InputError where it holds something already or cannot be written.
    """
    sources = program_files.compact_files(_HASH_MODULE)
    sources |= {f"{PACKAGES[1]}/{_HASH}.py": f"CRC = 0x{own_crc():08X}\n", MANIFEST: _manifest()}
    package.fill(folder, {name: text.encode() for name, text in sources.items()})


def check_version(firmware_crc: int | None) -> None:
    """LinkError where a board's firmware has another version of the program; None: it has none."""
    if firmware_crc not in (None, own_crc()):
        raise LinkError(
            (
                f"the board's firmware has another version of the program built in ({firmware_crc:08x}, here "
                f"{own_crc():08x}), and files in the flash do not replace it: build the firmware anew ('armtempo "
                "deploy --firmware FOLDER', board/docs/firmware.md) or flash the one of MicroPython, then deploy "
                "again"
            ),
            (
                "build the firmware anew ('armtempo deploy --firmware FOLDER', board/docs/firmware.md) or flash "
                "the one of MicroPython, then deploy again"
            ),
        )


def _manifest() -> str:
    """The packages beside it, and what the board's own manifest has."""
    lines = [f'package("{name}", opt={_OPTIMISED})' for name in PACKAGES]
    return "\n".join(['include("$(PORT_DIR)/boards/manifest.py")', *lines, ""])
