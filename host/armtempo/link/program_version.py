"""The board program's sources on this machine, and their hash, which is compared with a board's."""

from __future__ import annotations

from functools import cache
from importlib.util import find_spec
from pathlib import Path

from armtempo_shared.program_hash import sources_crc

PACKAGES = ("armtempo_board", "armtempo_shared")
IN_LIBRARY = (*PACKAGES, "armtempo_sectors.mpy", "armtempo_erasing")
"""What a deployment writes to the board's /flash/lib, and removes; whatever else is there belongs to somebody else."""
UPDATE = "'armtempo flash' if the program is in the board's firmware, else 'armtempo deploy'"
"""What to do about another version."""


def package_folder(name: str) -> Path:
    """The folder of one of PACKAGES; found without importing it, as its modules need a board."""
    spec = find_spec(name)
    assert spec is not None  # both are installed with this package
    assert spec.origin is not None
    return Path(spec.origin).parent


@cache
def own_crc() -> int:
    """The hash of the program that this armtempo would deploy."""
    board, shared = (str(package_folder(name)) for name in PACKAGES)
    return sources_crc(board, shared)
