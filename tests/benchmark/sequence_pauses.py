"""What the chip computes before a motion, by itself and in a sequence: the figures of host/docs/sequences.md.

    python -m tests.benchmark.sequence_pauses MICROPYTHON [FOLDER]

As firmware_run: MicroPython's own firmware, with the program built in and with the program in compiled files, on QEMU,
which counts instructions, at 1.3 cycles each. The paper's arm moves between three postures, three times; in the first
cycle the board checks each motion whole, later only that it is still the same. Printed is how long the loop's turn
lasts in which one motion gives way to the next: code is imported, the motion checked, the rings are filled; and how
long that in which a motion begins that is not of a sequence, as ``armtempo plan`` makes it. What the clock of the
virtual board tells (tests/benchmark/sequences.py) comes on top. FOLDER keeps what was built.
"""

from __future__ import annotations

import re
from pathlib import Path

import armtempo
import numpy as np
from armtempo.errors import ArmtempoError
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.sequence import Sequence
from armtempo.robot.connect import connect

from tests.benchmark import firmware_run

CYCLES = 3
LEGS = 3
SEQUENCE = """
name = "there-and-back"
start = "home"
[[step]]
repeat = %d
[[step]]
goto = [10, -65, 45]
[[step]]
goto = [-5, -50, 30]
[[step]]
goto = "home"
[[step]]
end = "repeat"
"""


def pauses_ms(elf: Path, image: Path, folder: Path) -> list[int]:
    """How long the turn took that began each motion, ms, in their order: those of the sequence, the first of which does
    what ``start`` does too, then those by themselves.
    """
    arm = firmware_run.unwatched(Arm.paper())
    file = folder / "sequence.toml"
    file.write_text(SEQUENCE % CYCLES)
    plan = armtempo.plan_sequence(arm, Sequence.load(file, arm))
    home, away = list(arm.home_deg), list(np.add(arm.home_deg, 10.0))
    ways = {"out": [home, away], "in": [away, home]}
    alone = [armtempo.plan(arm, Job(name=name, via_deg=via)) for name, via in ways.items()]
    with firmware_run.running(elf, image) as (port, said):
        with connect(port) as board:
            board.home(arm)
            end = board.run_sequence(plan)
            assert (end.ending, end.cycle) == ("finished", CYCLES), end
            for one in alone:
                board.run(one)
        text = "".join(said)
    return [int(found) for found in re.findall(r"@ start (\d+)", text)]


def main(micropython: Path, folder: Path) -> None:
    """Print the figures."""
    for title, elf, image in firmware_run.both_ways(micropython, folder):
        try:
            found = pauses_ms(elf, image, folder)
        except ArmtempoError as error:  # beside the stand-ins its memory may be too short
            print(f"{title}: {error}")
            continue
        first, then, alone = found[:LEGS], found[LEGS : LEGS * CYCLES], found[LEGS * CYCLES :]
        print(f"{title}: first cycle {first} ms, then {then} ms; by themselves {alone} ms", flush=True)


if __name__ == "__main__":
    firmware_run.start(main)
