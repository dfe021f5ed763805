"""A firmware onto a board: over USB by dfu-util, or through an ST-LINK by st-flash; read back and compared.

The pieces are written from the highest address down: the last one holds the vectors, without which a chip does not
start. A board whose flashing was cut off stays in its bootloader, or gets there by its BOOT0 pin, and is flashed again.
The file system lies between the pieces and is kept.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from armtempo.basics.errors import InputError, LinkError, ToolError
from armtempo.basics.progress import Progress
from armtempo.deploy.changes import Tell
from armtempo.deploy.firmware import image
from armtempo.deploy.firmware.image import Image
from armtempo.deploy.install import end_program
from armtempo.deploy.remote import Remote
from armtempo.link.program_version import own_crc
from armtempo.ports.names import is_sim

DFU, STLINK = "dfu-util", "st-flash"
TOOLS = (DFU, STLINK)
_CHIP = "0483:df11"
"""USB vendor and product of the chip's bootloader (AN2606)."""
_APPEARS_S = 15.0
_LOOK_S = 0.5
_INSTALL = {
    DFU: "sudo apt install dfu-util, brew install dfu-util, or dfu-util.sourceforge.net",
    STLINK: "sudo apt install stlink-tools, brew install stlink, or github.com/stlink-org/stlink",
}
_BY_HAND = (
    "connect BOOT0 to VDD (on a pyboard DFU to 3V3), press reset, and leave --port out; "
    "on Linux the device also needs a udev rule, or sudo"
)


def flash(given: Path, port: str | None, tool: str | None, tell: Tell, progress: Progress) -> None:
    """Put a firmware on a board: the folder that ``build`` made, or the zip file of a release.

    ``port``: where the board answers now; None: it is in its bootloader, or an ST-LINK is connected. ``tool``: one
    of TOOLS; None: the first that is installed. Raises InputError where the folder holds no firmware, LinkError
    where the board is moving or another one than the firmware is for, ToolError where a tool is missing or fails.
    """
    with image.unpacked(given) as folder:
        _flash(folder, port, tool, tell, progress)


def _flash(folder: Path, port: str | None, tool: str | None, tell: Tell, progress: Progress) -> None:
    firmware = image.read(folder)
    chosen = _choose(tool)
    if firmware.program_crc != own_crc():
        tell(
            f"this firmware has another version of the program than this armtempo ({firmware.program_crc:08x})"
        )
    if port is not None:
        _prepare(port, firmware, chosen, tell)
    elif chosen == DFU:
        _wait_for_bootloader(0.0)
    pieces = sorted(firmware.pieces, key=lambda piece: -piece.address)
    steps = 2 * len(pieces) + 1
    for number, piece in enumerate(pieces):
        progress(number, steps)
        _run(_write(chosen, folder / piece.file, piece.address))
    for number, piece in enumerate(pieces, len(pieces)):
        progress(number, steps)
        _compare(chosen, folder / piece.file, piece.address)
    _start(chosen, pieces[-1].address)
    progress(steps, steps)


def _compare(tool: str, file: Path, address: int) -> None:
    """Read a piece back; ToolError if the chip has something else."""
    wanted = file.read_bytes()
    with TemporaryDirectory(prefix="armtempo-flash-") as name:
        back = Path(name) / "back.bin"
        _run(_read(tool, back, address, len(wanted)))
        found = back.read_bytes()[: len(wanted)] if back.exists() else b""
    if found != wanted:
        raise ToolError(
            f"what was read back at {address:#010x} is not what was written",
            f"flash again, with a shorter cable if it comes again; {_BY_HAND}",
        )


def _choose(tool: str | None) -> str:
    """The tool to use; ToolError where it is not installed."""
    wanted = TOOLS if tool is None else (tool,)
    found = next((name for name in wanted if shutil.which(name)), None)
    if found is None:
        ways = "; ".join(f"{name}: {_INSTALL[name]}" for name in wanted)
        raise ToolError(f"{' and '.join(wanted)} not installed, and needed to flash", f"install one: {ways}")
    return found


def _prepare(port: str, firmware: Image, tool: str, tell: Tell) -> None:
    """See that the board at ``port`` is the right one and stands still; with dfu-util, put it in its bootloader."""
    if is_sim(port):
        raise InputError("a virtual board has no flash for a firmware", "name a real one with --port")
    end_program(port, tell)
    remote = Remote(port)
    machine = remote.survey().machine
    if machine != firmware.machine:
        raise LinkError(
            f"the board at {port} is a {machine}, the firmware is for a {firmware.machine}, and would not start there",
            f"build one for that board ('armtempo firmware --board'), or, if it runs a wrong firmware: {_BY_HAND}",
        )
    if tool == DFU:
        remote.run(["bootloader"])
        _wait_for_bootloader(_APPEARS_S)


def _wait_for_bootloader(patience_s: float) -> None:
    """Wait until just one chip's bootloader is on USB; ToolError where there is none, or more."""
    begin = time.monotonic()
    while (count := _bootloaders()) == 0 and time.monotonic() - begin < patience_s:
        time.sleep(_LOOK_S)
    if count != 1:
        seen = "no board in its bootloader" if count == 0 else f"{count} boards in their bootloader"
        raise ToolError(
            f"{DFU} sees {seen} on USB", f"connect one, by the socket wired to the chip; {_BY_HAND}"
        )


def _bootloaders() -> int:
    done = subprocess.run([DFU, "--list"], capture_output=True, text=True, check=False)
    return len(re.findall(rf"^Found DFU: \[{_CHIP}\].*alt=0", done.stdout, re.MULTILINE))


def _write(tool: str, file: Path, address: int) -> list[str]:
    """The command that writes a piece."""
    if tool == STLINK:
        return [STLINK, "--connect-under-reset", "write", str(file), f"{address:#010x}"]
    return [DFU, "-d", _CHIP, "-a", "0", "-s", f"{address:#010x}", "-D", str(file)]


def _read(tool: str, file: Path, address: int, size: int) -> list[str]:
    """The command that reads a piece back."""
    if tool == STLINK:
        return [STLINK, "--connect-under-reset", "read", str(file), f"{address:#010x}", str(size)]
    return [DFU, "-d", _CHIP, "-a", "0", "-s", f"{address:#010x}:{size}", "-U", str(file)]


def _start(tool: str, vectors: int) -> None:
    """Let the board start. dfu-util cannot tell whether it did: the chip leaves USB while it is asked."""
    if tool == STLINK:
        _run([STLINK, "reset"])
        return
    with TemporaryDirectory(prefix="armtempo-flash-") as name:
        command = [
            DFU,
            "-d",
            _CHIP,
            "-a",
            "0",
            "-s",
            f"{vectors:#010x}:4:leave",
            "-U",
            str(Path(name) / "back.bin"),
        ]
        subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, check=False)


def _run(command: list[str]) -> None:
    done = subprocess.run(
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    if done.returncode:
        said = "\n  ".join(done.stdout.strip().splitlines()[-5:])
        raise ToolError(
            f"{' '.join(command)} failed, and the board has no whole firmware now:\n  {said}",
            "flash again: " + ("is the ST-LINK connected?" if command[0] == STLINK else _BY_HAND),
        )
