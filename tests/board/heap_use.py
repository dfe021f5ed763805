"""The heap that the compiled board program needs, on 32-bit MicroPython: ``python -m tests.board.heap_use``.

The shipped arm; the image that ``armtempo deploy`` writes to the chip's flash, at its address there; registers are
plain memory. The program finds as much heap as MicroPython's firmware leaves it on the chip, and sizes its memory by
that. ``code elsewhere``: functions whose code is not in the flash.
"""

from __future__ import annotations

import os
import struct
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from armtempo.deploy import program_files
from armtempo.deploy.program_files import STM32F4
from armtempo.encoding import encode
from armtempo.model import arm
from armtempo.model.arm import Arm
from armtempo.planning import point_to_point
from armtempo_shared import wire

from tests import interpreters

SCRIPTS = interpreters.ROOT / "tests" / "board" / "scripts"
INTERPRETER = "micropython-arm"
SESSION = ("hello", "home", "start")
HEAP = 103_400
"""Bytes that MicroPython 1.28 has to give on an STM32F4DISC: 105 820 less the collector's tables."""


def measure() -> dict[str, int]:
    """Bytes in use at each stage, and ``code elsewhere``."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "lib").mkdir()
        for path, data in program_files.library(STM32F4).items():
            (folder / "lib" / Path(path).name).write_bytes(data)
        (folder / "sectors").write_bytes(program_files.image(STM32F4))
        write_session(folder, Arm.paper())
        lines = _run(folder, HEAP).splitlines()
        assert accepted((folder / "answers").read_bytes()) == len(SESSION)
    return {stage: int(value) for stage, value in (line.rsplit(maxsplit=1) for line in lines)}


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
    """Run in the folder and by short names: the names of files are in the heap, by their length."""
    (folder / "scripts").symlink_to(SCRIPTS)
    arguments = [".", "frames", "answers", str(heap), "sectors"]
    command = [
        interpreters.starter(INTERPRETER),
        "-X",
        "heapsize=2M",
        "scripts/benchmarks/memory_use.py",
        *arguments,
    ]
    environment = {**os.environ, "MICROPYPATH": f"lib{os.pathsep}.frozen"}
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=1200, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


if __name__ == "__main__":
    stages = measure()
    for stage, size in stages.items():
        print(f"{stage:<14}{size:>8}")
