"""What a pass of the program's loop costs on the chip, and up to which rates it keeps up: host/docs/measurements.md.

    python -m tests.benchmark.loop MICROPYTHON [files]
    python -m tests.benchmark.loop MICROPYTHON stops [COUNT [SEED [RATE]]]
    python -m tests.benchmark.loop MICROPYTHON backlash

MICROPYTHON as for tests/benchmark/firmware.py. The program is built into stock MicroPython for the chip, and
that is run by QEMU, which counts instructions: so long lasts the motion's time meanwhile, so a ring that the loop comes
back to too late runs dry as on the chip. What stands in for timers, DMA, USB, encoders, backup SRAM: loop_board.c and
tests/board/scripts/benchmarks/firmware_loop.py. With ``files`` after it only the costs of a turn, with the program in
files; only what stands around it is built in, as its heap is not the program's.

With ``stops`` it counts how a stop, a pause with its end and a change of speed end, COUNT of each at random moments of
a motion up to the rates that hello states (or RATE, of each joint), with one to six joints.

With ``backlash`` one, three and six joints reverse again and again, and cross their backlash at up to the rate that the
host allows.
"""

from __future__ import annotations

import itertools
import random
import sys
import tempfile
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from statistics import median

from armtempo_shared.limits import (
    MAX_CROSSING_RATE,
    MAX_JOINTS,
    MAX_STEP_RATE,
    MAX_STEP_RATE_SUM,
)

from tests.benchmark.loop_board import BRAKE, CORE_HZ, CYCLES, Board, Case, Run, cruise, paper, reversing

JOINTS = (1, 3)
AT_LIMITS = ((240_000, 1), (120_000, 2), (80_000, 3), (25_000, 3), (2_000, 6), (8_000, 6), (20_000, 6))
"""Rates of each joint, and joints: at the limits that hello states, and where many start together."""
# As ``cruise`` takes them
SIX = (
    (40_000, 6, 0.5, 1.2),
    (20_000, 6, 1.0, 2.2),
    (40_000, 6, 1.0, 2.2),
    (40_000, 6, 2.0, 4.2),
)
WORST_CYCLES = 3.0
CHANGES = ((BRAKE,), (0, 1000))
CHANGED = ((240_000, 1), (40_000, 1), (80_000, 3), (25_000, 3), (8_000, 6), (20_000, 6), (40_000, 6))
"""Rates of each joint, and joints, whose speed is changed."""
SOME_CYCLES = (1.3, 2.0, 3.0)
SOME_CHANGES = ((BRAKE,), (0, 1000), (300, 1000))
"""At random moments."""
CROSSED = ((60, 0.5), (1000, 1.5))
"""Steps of backlash, and seconds to and fro: a crossing as short as a jerk, and one that lasts until the next."""
MILLION = (333_000, 3, 1.0, 2.4)  # steps/s in sum; as ``cruise`` takes them


def _line(name: str, costs: Iterable[float]) -> str:
    found = sorted(costs)
    if not found:
        return f"    {name:<58} none"
    return f"    {name:<58}{median(found) / 1e3:7.0f}{found[-1] / 1e3:7.0f}   {len(found):5d} times"


def describe(run: Run) -> list[str]:
    """What turns and the interrupt cost."""
    calm = [turn for turn in run.turns if not turn.command and not turn.answer]
    return [
        _line("turn, no cell taken up", (turn.cost for turn in calm if not turn.cells)),
        _line("turn, one cell", (turn.cost for turn in calm if turn.cells == 1)),
        _line("turn, more cells", (turn.cost for turn in calm if turn.cells > 1)),
        _line("turn with a command", (turn.cost for turn in run.turns if turn.command)),
        _line(
            "turn with a sample to send",
            (turn.cost for turn in run.turns if turn.answer and not turn.command),
        ),
        _line("interrupt", (feed for turn in run.turns for feed in turn.feeds)),
    ]


def _end(run: Run) -> str:
    return (
        f"ends by fault {run.fault} after {run.seconds:.2f} s"
        if run.fault
        else f"ends well after {run.seconds:.2f} s"
    )


def some_changes(changes: tuple[int, ...], rate: int, joints: int, rng: random.Random) -> Case:
    """A motion of 3 s with ramps of 0.6 s, and changes from a random moment of it on."""
    case = cruise(rate, joints, 0.6, 3.0, changes)
    return replace(case, first_change=rng.randrange(1, 26), every_ms=rng.randrange(30, 60))


def count_stops(board: Board, count: int, seed: int, rate: int) -> None:
    """Print how many of random stops, pauses and changes end in order. ``rate``: of each joint; 0: as hello states."""
    rng = random.Random(seed)
    print(f"seed {seed}; in order of {count} stops, {count} pauses with their end, {count} changes of speed")
    for cycles, joints in itertools.product(SOME_CYCLES, range(1, MAX_JOINTS + 1)):
        each = rate or min(MAX_STEP_RATE_SUM // joints, MAX_STEP_RATE)
        cases = [some_changes(what, each, joints, rng) for what in SOME_CHANGES for _ in range(count)]
        with ThreadPoolExecutor(2) as pool:
            runs = list(pool.map(board.run, cases, itertools.repeat(cycles)))
        ends = [sum(not run.fault for run in runs[at : at + count]) for at in range(0, len(runs), count)]
        print(f"    {cycles} cycles, joints {joints}, {each} steps/s: {ends}", flush=True)


def cross(board: Board) -> None:
    """Print what a turn costs in which joints cross their backlash, and how such motions end."""
    for joints, (play, period_s) in itertools.product((1, 3, MAX_JOINTS), CROSSED):
        case = reversing(MAX_CROSSING_RATE, joints, play, period_s)
        print(f"joints {joints}, {play} steps, {period_s} s to and fro", flush=True)
        for cycles in SOME_CYCLES:
            run = board.run(case, cycles)
            print(f"    {cycles} cycles: {_end(run)}; {_turns(run, cycles)}", flush=True)
            if cycles == SOME_CYCLES[0]:
                print("\n".join(describe(run)), flush=True)


def main(micropython: Path, as_files: bool) -> None:
    """Print the figures."""
    with tempfile.TemporaryDirectory() as name:
        board = Board(micropython, Path(name), as_files)
        for title, case in (("the paper's motion", paper()), ("3 joints, 50 000 steps/s", cruise(50_000, 3))):
            print(f"{title}: thousands of instructions, median and most")
            print("\n".join(describe(board.run(case, CYCLES[0]))), flush=True)
        if as_files:
            return
        for cycles in CYCLES:
            run = board.run(paper(), cycles)
            print(f"{cycles} cycles: the paper's motion {_end(run)}; {_turns(run, cycles)}", flush=True)
            for joints in JOINTS:
                rate, best = board.highest(joints, cycles)
                print(f"{cycles} cycles, joints {joints}: {rate} steps/s; {_turns(best, cycles)}", flush=True)
        print("at single rates")
        for cycles in CYCLES:
            run = board.run(cruise(*MILLION), cycles)
            print(f"    {cycles} cycles, rate, joints, ramp {MILLION[:3]}: {_end(run)}", flush=True)
        _at_limits(board)


def _at_limits(board: Board) -> None:
    for cycles in (*CYCLES, WORST_CYCLES):
        print(f"    {cycles} cycles: the paper's motion {_end(board.run(paper(), cycles))}", flush=True)
        for rate, joints in AT_LIMITS:
            run = board.run(cruise(rate, joints), cycles)
            print(f"    {cycles} cycles, joints {joints}, {rate} steps/s: {_end(run)}", flush=True)
        for (rate, joints), changes in itertools.product(CHANGED, CHANGES):
            run = board.run(cruise(rate, joints, 0.6, 3.0, changes), cycles)
            print(
                f"    {cycles} cycles, joints {joints}, {rate} steps/s, speeds {changes}: {_end(run)}",
                flush=True,
            )
        for rate, joints, ramp_s, whole_s in SIX:
            run = board.run(cruise(rate, joints, ramp_s, whole_s), cycles)
            print(
                f"    {cycles} cycles, joints {joints}, {rate} steps/s, ramp {ramp_s}: {_end(run)}",
                flush=True,
            )


def _turns(run: Run | None, cycles: float) -> str:
    costs = sorted(turn.cost * cycles / CORE_HZ * 1e3 for turn in run.turns) if run else [0.0]
    return f"a turn takes {median(costs):.1f} ms, at most {costs[-1]:.1f} ms"


if __name__ == "__main__":
    if sys.argv[2:3] == ["stops"]:
        with tempfile.TemporaryDirectory() as folder:
            numbers = map(int, [*sys.argv[3:6], *("4", "1", "0")[len(sys.argv[3:6]) :]])
            count_stops(Board(Path(sys.argv[1]).resolve(), Path(folder)), *numbers)
    elif sys.argv[2:] == ["backlash"]:
        with tempfile.TemporaryDirectory() as folder:
            cross(Board(Path(sys.argv[1]).resolve(), Path(folder)))
    else:
        main(Path(sys.argv[1]).resolve(), sys.argv[2:] == ["files"])
