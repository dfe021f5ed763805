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
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from armtempo.basics.errors import InputError, LinkError, ToolError
from armtempo.basics.progress import Progress
from armtempo.deploy.changes import Tell
from armtempo.deploy.firmware import build, image
from armtempo.deploy.firmware.image import Image
from armtempo.deploy.install import end_program
from armtempo.deploy.remote import Remote
from armtempo.link.program_version import own_crc
from armtempo.ports.board_port import find_ports
from armtempo.ports.names import is_sim

DFU, STLINK = "dfu-util", "st-flash"
TOOLS = (DFU, STLINK)
_INSTALL = {
    DFU: "sudo apt install dfu-util, brew install dfu-util, or dfu-util.sourceforge.net",
    STLINK: "sudo apt install stlink-tools, brew install stlink, or github.com/stlink-org/stlink",
}
_DFU = (DFU, "-d", "0483:df11", "-a", "0", "-s")
_LOOK = {DFU: [DFU, "--list"], STLINK: ["st-info", "--probe"]}
_SEEN = {
    DFU: re.compile(
        r'^Found DFU: \[0483:df11\].* alt=0, name="@Internal Flash */0x08000000/(.*?)"', re.MULTILINE
    ),
    STLINK: re.compile(r"^ *flash: *(\d+)(?:.*\n){1,3} *chipid: *0x0*413\b", re.MULTILINE),
}
"""A chip that can be flashed, with its flash: the sectors as its bootloader names them (AN2606, UM0424), or bytes. The
chip id is that of STM32F405 and F407 (RM0090, DBGMCU_IDCODE)."""
_REACH = {
    DFU: "connect BOOT0 to VDD and press reset; how, and the udev rule for Linux: 'armtempo help firmware'",
    STLINK: "connect the ST-LINK, and power the board",
}
_FLASH_START = 0x08000000
_APPEARS_S = 15.0
_LOOK_S = 0.5
_PERCENT = re.compile(r"^(?:Down|Up)load\s.*?(\d+)%")
"""dfu-util's own progress."""


def flash(given: Path, port: str | None, tool: str | None, tell: Tell, progress: Progress) -> None:
    """Put a firmware on a board: the folder that ``build`` made, or a zip file of it.

    ``port``: where the board answers. One that is not there, or None: the board in its bootloader, or at the
    ST-LINK; else the only MicroPython board that is plugged in. ``tool``: one of TOOLS; None: the first that is
    installed. Raises InputError if the folder contains no firmware, LinkError if the board is moving or another
    one than the firmware is for, ToolError if a tool is missing or fails.
    """
    with image.unpacked(given) as folder:
        firmware = image.read(folder)
        chosen = _choose(tool)
        about = (
            f"MicroPython {firmware.micropython} for {firmware.machine}, program {firmware.program_crc:08x}"
        )
        other = "" if firmware.program_crc == own_crc() else f"; another version than here, {own_crc():08x}"
        tell(f"{about}{other}")
        _prepare(port, firmware, chosen, tell)
        end = max(piece.address + (folder / piece.file).stat().st_size for piece in firmware.pieces)
        _check_chip(chosen, end)
        try:
            _put(folder, firmware, chosen, progress)
        except KeyboardInterrupt:
            raise KeyboardInterrupt(
                "the board has no whole firmware now; 'armtempo flash' again repairs it"
            ) from None


def _choose(tool: str | None) -> str:
    """The tool to use; ToolError if it is not installed."""
    wanted = TOOLS if tool is None else (tool,)
    found = next((name for name in wanted if shutil.which(name)), None)
    if found is None:
        ways = "; ".join(f"{name}: {_INSTALL[name]}" for name in wanted)
        raise ToolError(f"{' and '.join(wanted)} not installed, and needed to flash", f"install one: {ways}")
    return found


def _prepare(port: str | None, firmware: Image, tool: str, tell: Tell) -> None:
    """See that a board with a port is the right one and nothing moves; for dfu-util, put it in its bootloader."""
    if port is None and not _chips(tool):
        boards = [each.device for each in find_ports() if each.board]
        port = boards[0] if len(boards) == 1 else None
    if port is None:
        return
    if is_sim(port):
        raise InputError("a virtual board has no flash for a firmware", "give a real one with --port")
    try:
        end_program(port, tell)
    except InputError as error:
        if not _chips(tool):
            raise InputError(f"{error.problem}, and {tool} sees no board", _REACH[tool]) from None
        tell(f"{error.problem}; the board that {tool} sees is flashed")
        return
    remote = Remote(port)
    machine = remote.survey().machine
    if machine != firmware.machine:
        raise LinkError(
            f"the board at {port} is a {machine}, the firmware is for a {firmware.machine}, and would not start there",
            f"take one for that board; if it runs a wrong firmware now: {_REACH[tool]}, and unset the port",
        )
    if tool == DFU:
        remote.run(["bootloader"])
        begin = time.monotonic()
        while not _chips(tool) and time.monotonic() - begin < _APPEARS_S:
            time.sleep(_LOOK_S)


def _check_chip(tool: str, end: int) -> None:
    """ToolError unless the tool sees just one chip, whose flash is large enough."""
    chips = _chips(tool)
    if len(chips) != 1:
        seen = "no STM32F405 or F407" if not chips else f"{len(chips)} boards"
        raise ToolError(f"{tool} sees {seen}", _REACH[tool] if not chips else "connect only one")
    if not end <= _FLASH_START + chips[0] <= _FLASH_START + (1 << 20):
        raise ToolError(
            f"the chip has {chips[0] // 1024} KB of flash, the firmware is for another one",
            "take a firmware that is for this board",
        )


def _chips(tool: str) -> list[int]:
    """Bytes of flash of each chip that the tool sees; ToolError if it may not look."""
    try:
        done = subprocess.run(_LOOK[tool], capture_output=True, text=True, check=False)
    except FileNotFoundError:
        raise ToolError(f"{_LOOK[tool][0]} not installed", _INSTALL[tool]) from None
    if "Cannot open DFU device" in done.stderr:
        raise ToolError(
            "no permission for the board's bootloader", "'armtempo help firmware' has the udev rule"
        )
    return [_size(text) for text in _SEEN[tool].findall(done.stdout)]


def _size(text: str) -> int:
    """Bytes, of a number or of sectors like ``04*016Kg,01*064Kg``."""
    sectors = re.findall(r"(\d+)\*(\d+)K", text)
    return sum(int(count) * int(size) << 10 for count, size in sectors) if sectors else int(text)


def _put(folder: Path, firmware: Image, tool: str, progress: Progress) -> None:
    """Write the pieces, read them back, start the board."""
    pieces = sorted(firmware.pieces, key=lambda piece: -piece.address)
    sizes = [(folder / piece.file).stat().st_size for piece in pieces]
    done, whole = 0, 2 * sum(sizes)
    with TemporaryDirectory(prefix="armtempo-flash-") as name:
        for reading in (False, True):
            for piece, size in zip(pieces, sizes, strict=True):
                file, back = folder / piece.file, Path(name) / piece.file
                command = _command(tool, back if reading else file, piece.address, size if reading else None)
                progress(done, whole)
                if said := build.run(command, partial(_tell, progress, done, size, whole)):
                    raise ToolError(
                        f"{' '.join(command)} failed, and the board has no whole firmware now:\n  {said}",
                        f"flash again: {_REACH[tool]}",
                    )
                done += size
                if reading and back.read_bytes()[:size] != file.read_bytes():  # st-flash reads whole words
                    raise ToolError(
                        f"the data read back at {piece.address:#010x} differ from what was written",
                        f"flash again, with a shorter cable if it happens again; {_REACH[tool]}",
                    )
        vectors = f"{pieces[-1].address:#010x}:4:leave"
        start = [STLINK, "reset"] if tool == STLINK else [*_DFU, vectors, "-U", str(Path(name) / "start")]
        # Not checked: the chip leaves USB while it is asked.
        subprocess.run(start, stdin=subprocess.DEVNULL, capture_output=True, check=False)
    progress(whole, whole)


def _command(tool: str, file: Path, address: int, size: int | None) -> list[str]:
    """Read ``size`` bytes into a file; None: write it."""
    at = f"{address:#010x}"
    if tool == DFU:
        return [*_DFU, at if size is None else f"{at}:{size}", "-D" if size is None else "-U", str(file)]
    end = [] if size is None else [str(size)]
    return [STLINK, "--connect-under-reset", "write" if size is None else "read", str(file), at, *end]


def _tell(progress: Progress, done: int, size: int, whole: int, line: str) -> None:
    """The progress that a line of the tool tells of."""
    if found := _PERCENT.match(line):
        progress(done + size * int(found[1]) / 100, whole)
