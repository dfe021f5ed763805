"""The heap that the compiled board program needs, on 32-bit MicroPython: ``python -m tests.benchmark.memory``.

The shipped arm; files compiled for the Cortex-M4 as ``armtempo deploy`` does it; registers are plain memory. The
interpreter keeps machine code outside of its heap, the chip within: its size is read from the files and added.
"""

from __future__ import annotations

import os
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from armtempo import arm, encode, moves, operate
from armtempo.deploy import program
from armtempo.deploy.package import STM32F4

from tests import interpreters
from tests.benchmark.emulated import machine_code_bytes

SCRIPT = interpreters.ROOT / "tests" / "board" / "scripts" / "memory_use.py"
INTERPRETER = "micropython-arm"


def measure() -> dict[str, int]:
    """Bytes in use after each stage, and ``machine code``."""
    library = {path.removeprefix(f"{program.ROOT}/"): data for path, data in program.library(STM32F4).items()}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for path, data in library.items():
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / path).write_bytes(data)
        lines = _run(folder, _fill_store(folder)).splitlines()
    found = {stage: int(value) for stage, value in (line.rsplit(maxsplit=1) for line in lines)}
    found["machine code"] = sum(map(machine_code_bytes, library.values()))
    return found


def _fill_store(folder: Path) -> list[str]:
    """Store an arm and a motion; where its joints begin, in steps."""
    shipped = arm.load_arm(arm.default_path())
    home_deg = operate.home_deg(shipped)
    trajectory = moves.straight("go", home_deg, home_deg + np.array([2.0, 1.0, -2.0]), shipped)
    (folder / "arm.ata").write_bytes(encode.arm_record(shipped))
    (folder / "go.atm").write_bytes(encode.motion_record(trajectory, shipped))
    pairs = zip(home_deg, shipped.driven, strict=True)
    return [str(round(float(angle) * encode.steps_per_deg(joint))) for angle, joint in pairs]


def _run(folder: Path, starts: list[str]) -> str:
    command = [interpreters.starter(INTERPRETER), "-X", "heapsize=2M", str(SCRIPT), str(folder), *starts]
    environment = {**os.environ, "MICROPYPATH": f"{folder / 'lib'}{os.pathsep}.frozen"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=100, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


if __name__ == "__main__":
    stages = measure()
    for stage, size in stages.items():
        print(f"{stage:<14}{size:>8}")
    print(f"{'on the chip':<14}{stages['motion'] + stages['machine code']:>8}  (estimate)")
