"""One board's firmware with the program, built by MicroPython's own makefiles and put into a folder."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path

from armtempo.basics.errors import InputError, ToolError
from armtempo.basics.progress import Progress
from armtempo.deploy.firmware import checkout, frozen, image
from armtempo.deploy.firmware.checkout import BoardDefinition, Checkout
from armtempo.link.program_version import own_crc

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


_FILES = 330
"""That a build compiles, about; for its progress."""
_WHOLE = ("firmware.dfu", "firmware.hex", "firmware.elf")
"""The same firmware in one file, for other tools."""


def build(micropython: Path, board: str, out: Path, progress: Progress) -> image.Image:
    """Build the firmware of a board, by its name in MicroPython or a folder that defines it, into a new folder ``out``.

    What the compiler makes stays in the checkout, in ``ports/stm32/build-BOARD-armtempo``, so the next build is short.
    Raises InputError if checkout, submodules or board do not suit or ``out`` holds something, ToolError if a
    compiler is missing or the build fails; ``out`` is then as it was.
    """
    found = checkout.look(micropython)
    definition = checkout.board(found, board)
    checkout.check_submodules(found, definition)
    check(with_mpy_cross=not has_mpy_cross(found.folder))
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise InputError(f"{out} already exists", "name a new folder with --out")
    built = _make(found, definition, progress)
    made = image.Image(
        definition.name,
        definition.machine,
        found.release,
        version(),
        own_crc(),
        _pieces(definition),
    )
    _check_size(built, made, definition)
    _put(built, made, out)
    return made


def _pieces(definition: BoardDefinition) -> tuple[image.Piece, ...]:
    """The files that MicroPython's build makes, one for each address."""
    if len(definition.addresses) == 1:
        return (image.Piece("firmware.bin", definition.addresses[0]),)
    return tuple(
        image.Piece(f"firmware{number}.bin", address) for number, address in enumerate(definition.addresses)
    )


def _make(found: Checkout, definition: BoardDefinition, progress: Progress) -> Path:
    """Run make; the folder with what it built."""
    built = found.port / f"build-{definition.name}-armtempo"
    program = built / "armtempo"
    shutil.rmtree(program, ignore_errors=True)
    frozen.write(program, definition.manifest)
    common = [f"-j{os.cpu_count() or 1}"]
    if not has_mpy_cross(found.folder):
        _run(["make", "-C", str(found.folder / "mpy-cross"), *common], lambda line: None)
    count = 0

    def step(line: str) -> None:
        nonlocal count
        count = min(count + 1, _FILES - 1)
        progress(count, _FILES)

    settings = {
        "BOARD_DIR": definition.folder,
        "BUILD": built,
        "FROZEN_MANIFEST": program / frozen.MANIFEST,
        "SOURCE_DATE_EPOCH": checkout.date(found),
    }
    _run(
        ["make", "-C", str(found.port), *common, *(f"{name}={value}" for name, value in settings.items())],
        step,
    )
    progress(_FILES, _FILES)
    return built


def _run(command: list[str], step: Callable[[str], None]) -> None:
    """Run make; ToolError with its last lines if it fails."""
    if said := run(command, step):
        raise ToolError(
            f"MicroPython's build failed:\n  {said}",
            f"for the whole output run {' '.join(command)}; with another version of MicroPython or of the compiler "
            f"than {checkout.RELEASE} and gcc 12 to 14, try those",
        )


def _check_size(built: Path, made: image.Image, definition: BoardDefinition) -> None:
    """ToolError if the firmware is larger than the chip's flash, which MicroPython's linker takes for 1 MB."""
    last = made.pieces[-1]
    end = last.address + (built / last.file).stat().st_size
    if end > definition.flash_end:
        raise ToolError(
            f"the firmware is {end - definition.flash_end} bytes larger than the flash of {definition.machine}",
            "use a board whose chip has 1 MB of flash",
        )


def _put(built: Path, made: image.Image, out: Path) -> None:
    """Copy the files aside and give them their place whole."""
    files = {piece.file: (built / piece.file).read_bytes() for piece in made.pieces}
    files |= {name: (built / name).read_bytes() for name in _WHOLE if name not in files}
    out.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=out.parent, prefix=f".{out.name}.") as name:
        whole = Path(name) / "whole"
        frozen.fill(whole, {**files, image.ABOUT: image.about(made)})
        os.replace(whole, out)
