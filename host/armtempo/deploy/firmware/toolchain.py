"""The programs that build a firmware: whether they are there."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

from armtempo.basics.errors import ToolError

CROSS = "arm-none-eabi-gcc"
INSTALL = (
    "install it, on Debian and Ubuntu: sudo apt install make gcc gcc-arm-none-eabi libnewlib-arm-none-eabi; on macOS: "
    "brew install --cask gcc-arm-embedded; else: Arm GNU Toolchain, arm-none-eabi, from developer.arm.com"
)
_TRIAL = "#include <math.h>\n#include <string.h>\n"
"""Headers of newlib, which some systems package apart from the compiler."""


def check(with_mpy_cross: bool) -> None:
    """ToolError where a program is missing; ``with_mpy_cross``: MicroPython's own compiler is still to be built."""
    needed = ["make", CROSS, *(["gcc"] if with_mpy_cross else [])]
    missing = [name for name in needed if shutil.which(name) is None]
    if missing:
        raise ToolError(f"{', '.join(missing)}: not installed, and needed to build a firmware", INSTALL)
    done = subprocess.run(
        [CROSS, "-xc", "-E", "-"], input=_TRIAL, capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise ToolError(f"{CROSS} has no C library (newlib)", INSTALL)


def version() -> str:
    """What the compiler says of itself."""
    done = subprocess.run([CROSS, "-dumpfullversion"], capture_output=True, text=True, check=False)
    return f"{CROSS} {done.stdout.strip()}"


def has_mpy_cross(checkout: Path) -> bool:
    """Whether MicroPython's own compiler is built."""
    return (checkout / "mpy-cross" / "build" / "mpy-cross").exists()
