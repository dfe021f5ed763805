"""Long sequences on virtual boards: ``python -m tests.benchmark.sequences [--cycles N] [--faults N] [--seed N]``.

``--cycles``: a pick and place of so many cycles, while hosts come and go; every motion's pulses must be those of the
same motion before, to the tick, and the steps must add up to nothing. ``--faults``: so many sequences that an E-stop, a
limit switch, a joint that is held fast or an input that never comes ends at a random moment, each in turn. Prints the
pauses between two motions as well.
"""

from __future__ import annotations

import argparse
import random
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import armtempo
import numpy as np
from armtempo.basics.errors import BoardError
from armtempo.model.parts import LimitSwitches
from armtempo.model.sequence_plan import SequencePlan
from armtempo.robot.board import Board
from armtempo.simulator import InjectedFault, LaunchOptions, edgelog, launch
from armtempo_shared import wire

from tests import interpreters
from tests.system.sequences import ARM, ESTOP, PART, net_steps, part_lies_there, pauses_s, small

LEGS = 3
GUARDED = replace(ARM, joints=(replace(ARM.joints[0], switches=LimitSwitches(high=1)), *ARM.joints[1:]))
LIMIT = "D8"
KINDS = {"estop": ESTOP, "limit_switch": LIMIT, "stall": "", "input_timeout": ""}
FAR = 20.0
"""So many times as far the arm goes where a joint is to stall: the encoder must notice."""


def cycles(number: int, numbers: random.Random, interpreter: str, folder: Path) -> None:
    """Many cycles beside hosts that come and go."""
    plan = small(folder, number)
    options = LaunchOptions(
        arm=ARM,
        faults=[part_lies_there()],
        edge_log=folder / "edges",
        interpreter=interpreters.starter(interpreter),
    )
    begun_s, hosts = time.monotonic(), 0
    with launch(options) as process:
        with armtempo.connect(process.port, ARM) as board:
            board.home(ARM)
            key = board.upload_sequence(plan)
            board.client.start(key.name, key.crc)
        while True:
            hosts += 1
            with armtempo.connect(process.port, ARM) as board:
                end = board.client.sequence()
                for _ in range(numbers.randrange(8)):
                    board.status()
                    time.sleep(0.05)
            if end.ending != "running":
                break
            time.sleep(numbers.uniform(0.0, 1.5))
    (power,) = edgelog.read(folder / "edges")
    lost = _check_edges(power, number)
    pauses = pauses_s(power, plan)
    print(
        f"{interpreter}: {end.ending} after {end.cycle} cycles, {hosts} hosts, {time.monotonic() - begun_s:.0f} s"
    )
    print(f"motions {len(power.starts)}, of other pulses than the first of their kind: {lost}")
    print(f"steps from home: {net_steps(power)}")
    if pauses:
        low, middle, high = np.percentile(pauses, [0, 50, 100])
        print(f"pause between two motions: {low:.3f} to {high:.3f} s, median {middle:.3f} s")


def _check_edges(power: edgelog.PowerCycle, number: int) -> int:
    """How many motions had other STEP edges than the first of their kind, which starts at another place in cycle 1."""
    assert len(power.starts) == LEGS * number, len(power.starts)
    lost = 0
    firsts = [power.motion(leg) for leg in range(LEGS)]
    for motion in range(LEGS, LEGS * number):
        now, first = power.motion(motion), firsts[motion % LEGS]
        lost += any(not np.array_equal(now[pin][0], first[pin][0]) for pin in ("A15", "A1", "B10"))
    return lost


def faults(number: int, numbers: random.Random, interpreter: str, folder: Path) -> None:
    """Sequences that something ends at a random moment."""
    near = small(folder, 4, "fault", arm=GUARDED)
    far = small(folder, 4, "fault", "far", GUARDED, FAR)
    told: dict[str, int] = {}
    for trial in range(number):
        kind = list(KINDS)[trial % len(KINDS)]
        run, at_s = numbers.randrange(2, 10), numbers.uniform(0.0, 0.6)
        pin = KINDS[kind] or PART
        fault = InjectedFault("input", at_s, run, name=pin, level=0 if KINDS[kind] else 1)
        if kind == "stall":
            fault = InjectedFault("block", at_s, run, joint=numbers.randrange(LEGS))
        options = LaunchOptions(
            arm=GUARDED,
            faults=[part_lies_there(), fault],
            edge_log=folder / f"edges{trial}",
            interpreter=interpreters.starter(interpreter),
        )
        with launch(options) as process, armtempo.connect(process.port, GUARDED) as board:
            result = _one(board, far if kind == "stall" else near)
        (power,) = edgelog.read(folder / f"edges{trial}")
        moved = [at - start for at, start in zip(result[1], result[2], strict=True)]
        assert moved == net_steps(power), (trial, kind, run, at_s, moved, net_steps(power))
        what = f"{kind}: {result[0]}"
        told[what] = told.get(what, 0) + 1
        (folder / f"edges{trial}").unlink()
    for what, times in sorted(told.items()):
        print(f"{times:>4} {what}")
    print(f"{interpreter}: {number} sequences; the commanded steps were those of the pins each time")


def _one(board: Board, plan: SequencePlan) -> tuple[str, list[int], list[int]]:
    """How a sequence ended with the fault, where the joints are by the board and where they were, in steps."""
    board.home(GUARDED)
    before = list(board.status().positions.commanded_steps)
    try:
        board.run_sequence(plan)
    except BoardError:
        assert board.output("gripper").state == "open", "not in its safe state"
    end = board.client.sequence()
    code = f" {wire.ERRORS[end.code][0]}" if end.code else ""
    after = list(board.status().positions.commanded_steps)
    time.sleep(0.3)
    assert list(board.status().positions.commanded_steps) == after, "it goes on"
    return end.ending + code, after, before


def main() -> None:
    """Read the arguments, run."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--cycles", type=int, default=0)
    parser.add_argument("--faults", type=int, default=0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--interpreter", default="micropython", choices=interpreters.AVAILABLE)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        if given.cycles:
            cycles(given.cycles, random.Random(given.seed), given.interpreter, Path(name))
        if given.faults:
            faults(given.faults, random.Random(given.seed), given.interpreter, Path(name))


if __name__ == "__main__":
    main()
