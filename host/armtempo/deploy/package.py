"""The board program as a folder that ``mpremote mip install`` takes, from there or from a repository."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

from armtempo.basics.errors import InputError
from armtempo.basics.installation import installed_version
from armtempo.deploy import program_files

PACKAGE = "package.json"
STM32F4 = 6 | 3 << 8 | 7 << 10
"""``sys.implementation._mpy`` of MicroPython 1.23 and newer on an STM32F405 or F407."""


def write(folder: Path) -> None:
    """Write compiled files, start files and package.json into a new or empty folder.

    Raises InputError if it holds something already or cannot be written.
    """
    files = {
        **program_files.library(STM32F4),
        **program_files.start_files(),
    }
    names = {path.removeprefix(f"{program_files.ROOT}/"): data for path, data in files.items()}
    content = {"version": installed_version(), "urls": [[name, name] for name in names]}
    fill(folder, {**names, PACKAGE: f"{json.dumps(content, indent=1)}\n".encode()})


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
