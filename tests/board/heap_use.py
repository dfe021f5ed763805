"""The heap that the compiled board program needs, on 32-bit MicroPython: ``python -m tests.board.heap_use``.

The shipped arm; files compiled for the Cortex-M4 as ``armtempo deploy`` does it; registers are plain memory. The
interpreter keeps machine code outside of its heap, the chip within: its size is read from the files and added. The
program finds as much heap as MicroPython's firmware leaves it on the chip, and sizes its memory for samples by that.
"""

from __future__ import annotations

import os
import struct
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from armtempo.deploy import program_files
from armtempo.deploy.package import STM32F4
from armtempo.model import arm
from armtempo.model.arm import Arm
from armtempo.planning import point_to_point
from armtempo.records import encode
from armtempo_shared import wire

from tests import interpreters
from tests.board.emulated import machine_code_bytes

SCRIPT = interpreters.ROOT / "tests" / "board" / "scripts" / "benchmarks" / "memory_use.py"
INTERPRETER = "micropython-arm"
SESSION = ("hello", "home", "start")
HEAP = 103_400
"""Bytes that MicroPython 1.28 has to give on an STM32F4DISC: 105 820 less the collector's tables."""


def measure() -> dict[str, int]:
    """Bytes in use at each stage, and ``machine code``."""
    library = {f"lib/{path}": data for path, data in program_files.compiled(STM32F4).items()}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for path, data in library.items():
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / path).write_bytes(data)
        write_session(folder, Arm.paper())
        machine_code = sum(map(machine_code_bytes, library.values()))
        at_start = machine_code_bytes(library["lib/armtempo_board/core.mpy"])
        lines = _run(folder, HEAP - at_start).splitlines()
        assert accepted((folder / "answers").read_bytes()) == len(SESSION)
    found = {stage: int(value) for stage, value in (line.rsplit(maxsplit=1) for line in lines)}
    found["machine code"] = machine_code
    return found


def write_session(folder: Path, of_arm: arm.Arm) -> None:
    """Store an arm and a motion, and write the frames of a host that starts it."""
    home_deg = np.array(of_arm.home_deg)
    trajectory = point_to_point.straight(
        "go", home_deg, home_deg + np.resize([2.0, 1.0, -2.0], home_deg.shape), of_arm
    )
    motion = encode.motion_record(trajectory, of_arm)
    (folder / "arm.ata").write_bytes(encode.arm_record(of_arm))
    (folder / "go.atm").write_bytes(motion)
    pairs = zip(home_deg, of_arm.driven, strict=True)
    steps = [round(float(angle) * joint.steps_per_deg) for angle, joint in pairs]
    values = {
        "hello": ((wire.PROTOCOL_VERSION, 1), b""),
        "home": (((1 << len(steps)) - 1,), struct.pack(f"<{len(steps)}i", *steps)),
        "start": ((0, wire.record_crc(motion)), b"go"),
    }
    with (folder / "frames").open("wb") as file:
        for sequence, name in enumerate(SESSION):
            entry = wire.COMMAND[name]
            frame = wire.frame(sequence, entry[1], wire.encode(entry, *values[name]))
            file.write(struct.pack("<H", len(frame)) + frame)


def accepted(answers: bytes) -> int:
    """Commands that were carried out."""
    parser = wire.Parser()
    parser.feed(answers)
    frames = iter(parser.next, None)
    return sum(number == wire.EVENT["ok"][1] for _, number, _ in frames)


def _run(folder: Path, heap: int) -> str:
    arguments = [str(folder), str(folder / "frames"), str(folder / "answers"), str(heap)]
    command = [interpreters.starter(INTERPRETER), "-X", "heapsize=2M", str(SCRIPT), *arguments]
    environment = {**os.environ, "MICROPYPATH": f"{folder / 'lib'}{os.pathsep}.frozen"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=1200, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


if __name__ == "__main__":
    stages = measure()
    for stage, size in stages.items():
        print(f"{stage:<14}{size:>8}")
