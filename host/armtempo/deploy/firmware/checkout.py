"""A checkout of MicroPython: its version, the boards of its stm32 port, its submodules."""

from __future__ import annotations

import re
import subprocess
from dataclasses import dataclass
from pathlib import Path

from armtempo.basics.errors import InputError
from armtempo.deploy.changes import release_problem
from armtempo.deploy.firmware import frozen

RELEASE = "v1.28.0"
"""MicroPython's tag that the firmwares of armtempo's releases are built from."""
BOARDS = ("STM32F4DISC", "OLIMEX_H407", "VCC_GND_F407ZG")
"""Boards with a firmware in releases; any other of the port with an STM32F405 or F407 can be built."""
_CHIPS = ("STM32F405xx", "STM32F407xx")
_FLASH_KB = {"E": 512, "G": 1024}
"""By the letter after the number of pins in the chip's name (data sheet, ordering information)."""
_FLASH_START = 0x08000000
_PARTS = ("MAJOR", "MINOR", "MICRO")
_LIBRARY = "lib/micropython-lib"
_OF_SETTINGS = {"MICROPY_PY_LWIP": "lib/lwip", "MICROPY_SSL_MBEDTLS": "lib/mbedtls"}
"""Submodules that a board needs whose makefile sets these to 1: it has a network."""


@dataclass(frozen=True)
class Checkout:
    """The folder of a checkout, and the version of MicroPython in it."""

    folder: Path
    version: tuple[int, int, int]

    @property
    def port(self) -> Path:
        """The port for the chip."""
        return self.folder / "ports" / "stm32"

    @property
    def release(self) -> str:
        """The version in words."""
        return ".".join(map(str, self.version))


@dataclass(frozen=True)
class BoardDefinition:
    """A board as MicroPython's build knows it."""

    name: str
    folder: Path
    machine: str
    """The firmware's ``os.uname().machine``."""
    manifest: str
    """The board's own manifest of frozen modules."""
    addresses: tuple[int, ...]
    """Addresses of the firmware's pieces in the flash."""
    flash_end: int


def how_to_get(folder: Path) -> str:
    """The command that makes a checkout."""
    return f"git clone --depth 1 --branch {RELEASE} https://github.com/micropython/micropython {folder}"


def look(folder: Path) -> Checkout:
    """The checkout in a folder; InputError if there is none, or its release is not fit."""
    try:
        text = (folder / "py" / "mpconfig.h").read_text(encoding="utf-8", errors="replace")
        numbers = [re.findall(rf"define MICROPY_VERSION_{part} (\d+)", text)[0] for part in _PARTS]
    except (OSError, IndexError):
        raise InputError(
            f"{folder} is not a MicroPython checkout", f"get one: {how_to_get(folder)}"
        ) from None
    found = Checkout(folder.resolve(), (int(numbers[0]), int(numbers[1]), int(numbers[2])))
    if problem := release_problem(found.version):
        raise InputError(
            f"{folder} is MicroPython {found.release}, {problem}",
            f"get a newer one: {how_to_get(Path('DIR'))}",
        )
    if " " in str(found.folder):
        raise InputError(
            f"{found.folder}: MicroPython's build takes no path with a space", "move the checkout"
        )
    return found


def date(checkout: Checkout) -> int:
    """Date of the last commit, seconds since 1970; 0 without git. Used as the build date of a firmware, so
    that the same sources make the same firmware.
    """
    try:
        command = ["git", "-C", str(checkout.folder), "log", "-1", "--format=%ct"]
        return int(subprocess.run(command, capture_output=True, check=True).stdout)
    except (OSError, ValueError, subprocess.CalledProcessError):
        return 0


def board(checkout: Checkout, name: str) -> BoardDefinition:
    """A board of the port by name, or by the path of a folder that defines one; InputError if it does not suit."""
    folder = Path(name).resolve() if "/" in name else checkout.port / "boards" / name
    try:
        make = (folder / "mpconfigboard.mk").read_text(encoding="utf-8", errors="replace")
        header = (folder / "mpconfigboard.h").read_text(encoding="utf-8", errors="replace")
    except OSError:
        raise InputError(
            f"MicroPython {checkout.release} has no board {name}",
            f"give one that suits: {', '.join(suitable(checkout))}",
        ) from None
    if _setting(make, "CMSIS_MCU") not in _CHIPS:
        raise InputError(
            f"{name} has no STM32F405 or F407",
            f"give one that suits: {', '.join(suitable(checkout))}",
        )
    manifest = _setting(make, "FROZEN_MANIFEST")
    chip = _text(header, "MICROPY_HW_MCU_NAME")
    size = re.search(r"F40[57][RVZI]([EG])", chip)
    return BoardDefinition(
        folder.name,
        folder,
        f"{_text(header, 'MICROPY_HW_BOARD_NAME')} with {chip}",
        f"$(PORT_DIR)/{manifest}" if manifest.startswith("boards/") else manifest or frozen.USUAL_MANIFEST,
        tuple(
            int(found, 16) for found in (_setting(make, "TEXT0_ADDR"), _setting(make, "TEXT1_ADDR")) if found
        ),
        _FLASH_START + 1024 * _FLASH_KB[size[1] if size else "G"],
    )


def suitable(checkout: Checkout) -> list[str]:
    """Names of the port's boards with an STM32F405 or F407."""
    files = sorted(checkout.port.glob("boards/*/mpconfigboard.mk"))
    return [
        file.parent.name
        for file in files
        if _setting(file.read_text(encoding="utf-8", errors="replace"), "CMSIS_MCU") in _CHIPS
    ]


def check_submodules(checkout: Checkout, definition: BoardDefinition) -> None:
    """InputError if a submodule that the port or the board needs is not there."""
    make = (checkout.port / "Makefile").read_text(encoding="utf-8", errors="replace")
    needed = {*re.findall(r"lib/\S+", " ".join(re.findall(r"GIT_SUBMODULES \+=(.*)", make))), _LIBRARY}
    board_make = (definition.folder / "mpconfigboard.mk").read_text(encoding="utf-8", errors="replace")
    needed |= {path for name, path in _OF_SETTINGS.items() if _setting(board_make, name) == "1"}
    missing = sorted(path for path in needed if not any((checkout.folder / path).glob("*")))
    if missing:
        raise InputError(
            f"{checkout.folder} lacks submodules ({', '.join(missing)})",
            f"get them: make -C {checkout.port} BOARD={definition.name} submodules",
        )


def _setting(make: str, name: str) -> str:
    """What a makefile sets a variable to, at last; "" if it does not."""
    found = re.findall(rf"^{name} *[?:]?= *(\S+)", make, re.MULTILINE)
    return str(found[-1]) if found else ""


def _text(header: str, name: str) -> str:
    """A string that a header defines; "" if it does not."""
    found = re.search(rf'define +{name} +"([^"]*)"', header)
    return found[1] if found else ""
