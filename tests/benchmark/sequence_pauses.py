"""What the chip computes before a motion, by itself and in a sequence: the figures of host/docs/sequences.md.

    python -m tests.benchmark.sequence_pauses MICROPYTHON [FOLDER]

As firmware_run: MicroPython's own firmware, with the program built in and with the program in compiled files, on QEMU,
which counts instructions, at 1.3 cycles each. An arm moves between three postures, three times; the board prepares each
motion while the one before moves. Printed is how long the loop's turn lasts in which one motion gives way to the next;
how long that in which a motion begins that is not of a sequence, as ``armtempo plan`` makes it: code is imported, the
motion checked; and the longest turn while something moves. 2 ms before a motion's time 0 come on top, 20 ms before that
of the first. FOLDER keeps what was built.
"""

from __future__ import annotations

import re
from pathlib import Path

import armtempo
import numpy as np
from armtempo.basics.errors import ArmtempoError
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.sequence import Sequence
from armtempo.robot.connect import connect

from tests.benchmark import firmware_run

CYCLES = 3
LEGS = 3
POSTURES = {
    "paper": ((10, -5, 5), (-5, 10, -10)),
    "ar4": ((2, 1, -2, 3, 2, 1), (-1, 2, 1, -2, 1, 2)),
}
"""By arm: where it goes, from home; degrees."""
SEQUENCE = """
name = "there-and-back"
start = "home"
[[step]]
repeat = %d
[[step]]
goto = %r
[[step]]
goto = %r
[[step]]
goto = "home"
[[step]]
end = "repeat"
"""


def turns_ms(name: str, elf: Path, image: Path, folder: Path) -> tuple[list[int], list[int]]:
    """How long the turn took that began each motion, ms: those of the sequence, then those by themselves;
    and the longest of each time something moved.
    """
    arm = firmware_run.unwatched(Arm.load(name))
    file = folder / "sequence.toml"
    file.write_text(
        SEQUENCE % (CYCLES, *([float(at) for at in np.add(arm.home_deg, by)] for by in POSTURES[name]))
    )
    plan = armtempo.plan_sequence(arm, Sequence.load(file, arm))
    home, away = list(arm.home_deg), list(np.add(arm.home_deg, 10.0))
    ways = {"out": [home, away], "in": [away, home]}
    alone = [armtempo.plan(arm, Job(name=way, via_deg=via)) for way, via in ways.items()]
    with firmware_run.running(elf, image) as (port, said):
        with connect(port) as board:
            board.home(arm)
            end = board.run_sequence(plan)
            assert (end.ending, end.cycle) == ("finished", CYCLES), end
            for one in alone:
                board.run(one)
        text = "".join(said)
    begun, longest = (
        [int(ms) for ms in re.findall(rf"@ {what} (\d+)", text)] for what in ("start", "longest")
    )
    return begun, longest


def main(micropython: Path, folder: Path) -> None:
    """Print the figures."""
    for title, elf, image in firmware_run.both_ways(micropython, folder):
        for name in POSTURES:
            try:
                found, longest = turns_ms(name, elf, image, folder)
            except ArmtempoError as error:  # as files
                print(f"{title}, {name}: {error}")
                continue
            first, then, alone = found[:LEGS], found[LEGS : LEGS * CYCLES], found[LEGS * CYCLES :]
            print(f"{title}, {name}: first cycle {first} ms, then {then} ms; by themselves {alone} ms")
            print(f"    while something moves: up to {max(longest)} ms", flush=True)


if __name__ == "__main__":
    firmware_run.start(main)
