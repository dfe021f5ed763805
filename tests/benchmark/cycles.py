"""Cycles that an instruction takes on the chip: ``python -m tests.benchmark.cycles MICROPYTHON``.

Some of MicroPython's own benchmarks were timed on a board with the same core, memory and clock (PYBv1.0, STM32F405 at
168 MHz, MicroPython of June 2019: pull request 4858). Here QEMU counts the instructions that today's MicroPython needs
for the same; MICROPYTHON as for tests/benchmark/firmware.py.
"""

from __future__ import annotations

import re
import sys
import tempfile
from pathlib import Path

from tests.benchmark import firmware

CORE_MHZ = 168
BOARD_US = {
    "viper_call0": 52_009,
    "viper_call2b": 79_517,
    "bm_fannkuch": 82_412,
    "misc_mandel": 138_049,
    "misc_pystone": 162_376,
}
_TIM2 = 0x40000000
_RUN = """
from machine import mem32
def bm_run(N, M):
    run, result = bm_setup(bm_params[max(nm for nm in bm_params if nm[0] <= N and nm[1] <= M)])
    mem32[{reload}] = 0xFFFFFFFF
    mem32[{counter}] = 0
    run()
    print("@ instructions", mem32[{counter}] & 0xFFFFFFFF)
bm_run(100, 100)
print("@ end")
"""


def count(elf: Path, source: Path, folder: Path) -> int:
    """Instructions of a benchmark."""
    tree = folder / source.stem
    tree.mkdir()
    ending = _RUN.format(reload=_TIM2 + 0x2C, counter=_TIM2 + 0x24)
    (tree / "main.py").write_text(source.read_text() + ending)
    image = firmware.make_image(tree)
    cut = folder / "cut"
    cut.write_bytes(bytes(4))
    found = re.search(r"@ instructions (\d+)", firmware.emulate(elf, image, cut, "-icount", "shift=0"))
    assert found, source
    return int(found[1])


def main(micropython: Path) -> None:
    """Print the figures."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        elf = firmware.build(micropython, folder, None)
        for benchmark, time_us in BOARD_US.items():
            counted = count(elf, micropython / "tests" / "perf_bench" / f"{benchmark}.py", folder)
            print(
                f"{benchmark:<14}{counted:>10} instructions{CORE_MHZ * time_us / counted:>6.2f} cycles each"
            )


if __name__ == "__main__":
    main(Path(sys.argv[1]).resolve())
