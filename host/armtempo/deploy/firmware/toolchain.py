"""The programs that build a firmware and write it: whether they are there, and running them."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

from armtempo.basics.errors import ToolError

CROSS = "arm-none-eabi-gcc"
INSTALL = (
    "install it, on Debian and Ubuntu: sudo apt install make gcc gcc-arm-none-eabi libnewlib-arm-none-eabi; on macOS: "
    "brew install --cask gcc-arm-embedded; else: Arm GNU Toolchain, arm-none-eabi, from developer.arm.com"
)
_TRIAL = "#include <math.h>\n#include <string.h>\n"
"""Headers of newlib, which some systems package apart from the compiler."""
_SAID_LINES = 12
"""Of a program that fails, the last ones are shown."""
_SAID_COLUMNS = 200


def run(command: list[str], heard: Callable[[str], None]) -> str:
    """Run a program, ``heard`` with each line that it prints; the last lines if it fails, else ""."""
    said: list[str] = []
    with subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as process:
        assert process.stdout is not None
        try:
            for line in process.stdout:
                said = [*said[1 - _SAID_LINES :], line.rstrip()[:_SAID_COLUMNS]]
                heard(line)
        except BaseException:
            process.terminate()
            raise
    return ("\n  ".join(said) or f"code {process.returncode}") if process.returncode else ""


def check(with_mpy_cross: bool) -> None:
    """ToolError if a program is missing; ``with_mpy_cross``: MicroPython's own compiler is still to be built."""
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
