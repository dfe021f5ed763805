"""What costs nothing in the simulation and much on the chip, in instructions: host/docs/measurements.md.

    python -m tests.benchmark.chip_costs MICROPYTHON [FOLDER]

MICROPYTHON as for tests/benchmark/firmware.py. The firmware with the program is built, in FOLDER if one is given, and
QEMU counts instructions of what the program calls at a start of a motion, of its own start, and of MicroPython's before
that. The flash is read as on the chip; USB is not there, and the clock is not set up.
"""

from __future__ import annotations

import math
import re
import sys
import tempfile
from pathlib import Path

import numpy as np
from armtempo.deploy import program_files
from armtempo.deploy.firmware import frozen
from armtempo.encoding import encode
from armtempo.model.arm import Arm
from armtempo.planning import point_to_point
from armtempo.planning.jog import jog_motion
from armtempo.planning.jog.jog_motion import JogMove
from armtempo_shared import motion
from armtempo_shared.limits import MAX_MOTION_BYTES, MAX_SEGMENTS

from tests.benchmark import arm_heap, firmware
from tests.benchmark.loop_board import CORE_HZ, CYCLES

PROBE = "import probe\n\nprobe.replace()\n" + firmware.START
_COUNTED = ("-icount", "shift=0,sleep=off")


def image(folder: Path) -> Path:
    """The image of a flash with an arm and two motions, the second as large as one may be."""
    tree = folder / "files"
    (tree / "armtempo").mkdir(parents=True)
    arm = encode.arm_record(Arm.paper())
    (tree / "armtempo" / "arm.ata").write_bytes(arm)
    joints, whole = len(Arm.paper().driven), range(1, MAX_SEGMENTS + 1)
    largest = max(count for count in whole if motion.size(5, joints, True, count, 1) <= MAX_MOTION_BYTES)
    for name, segments in (("go", 40), ("large", largest)):
        (tree / "armtempo" / f"{name}.atm").write_bytes(arm_heap.motion_record(arm, segments))
    here_deg = list(Arm.paper().home_deg)
    moved = jog_motion.plan("jog", Arm.paper(), here_deg, JogMove(math.inf, joint=0))
    target_deg = np.array(here_deg) + np.array([20.0, 10.0, -20.0])
    far = point_to_point.straight("goto", here_deg, target_deg, Arm.paper())
    records = {"jog": (moved.trajectory, moved.brakes), "goto": (far, None)}
    for name, (trajectory, brakes) in records.items():
        (tree / "armtempo" / f"{name}.atm").write_bytes(encode.motion_record(trajectory, Arm.paper(), brakes))
    for path, data in program_files.start_files().items():
        (tree / Path(path).name).write_text(data.decode().replace(firmware.START, PROBE))
    return firmware.make_image(tree, "firmware_costs.py")


def main(micropython: Path, folder: Path) -> None:
    """Print a line for each cost."""
    if not (folder / "program").exists():
        frozen.write(folder / "program")
    elf = firmware.build(micropython, folder, folder / "program" / "manifest.py")
    with tempfile.TemporaryDirectory(dir=folder) as name:
        cut = Path(name) / "cut"
        cut.write_bytes(bytes(4))
        said = firmware.emulate(elf, image(Path(name)), cut, *_COUNTED)
    found = re.findall(r"@ cost (\w+) (-?\d+)", said)
    assert "@ end" in said, said[-2000:]
    print(f"{'':<14}instructions, ms at {CYCLES[0]} and {CYCLES[-1]} cycles an instruction")
    for name, value in found:
        if name.startswith("bytes"):
            print(f"{name:<14}{value:>9}")
            continue
        low, high = (1e3 * cycles * int(value) / CORE_HZ for cycles in (CYCLES[0], CYCLES[-1]))
        print(f"{name:<14}{int(value):>9}  {low:7.2f} {high:7.2f}")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        main(Path(sys.argv[1]).resolve(), Path(sys.argv[2] if len(sys.argv) > 2 else folder).resolve())
