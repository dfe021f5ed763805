"""What a step costs on the STM32F407, counted on an emulated Cortex-M4.

    python tests/benchmark/cortex_m4.py            print the figures
    python tests/benchmark/cortex_m4.py --store    and keep them in cortex_m4.json, which a test holds changes against
    python tests/benchmark/cortex_m4.py --verify   hold what the emulated core computes against CPython, call by call

The compiled (viper) functions run as machine code on the emulated core, instruction by instruction; the bytecode
around them runs on CPython, and its lines are counted. All is deterministic.
"""

from __future__ import annotations

import json
import sys
from array import array
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from types import FrameType
from typing import Any

ROOT = Path(__file__).resolve().parent.parent.parent
STORED = Path(__file__).with_suffix(".json")
sys.path[:0] = [str(ROOT)] + [
    str(ROOT / folder) for folder in ("board", "shared", "host/armtempo/simulator/cpython", "host")
]

import micropython  # noqa: E402, F401  (puts ptr32 and its like into place)
from armtempo_board.hardware import isr  # noqa: E402
from armtempo_board.stepgen import (  # noqa: E402
    bezier,
    control_points,
    cubics,
    interval_steps,
    newton,
    step_generator,
    step_queue,
    subdivision,
    subintervals,
    time_law,
)
from armtempo_shared.motion import Motion  # noqa: E402

from tests.board import motions, oracle  # noqa: E402
from tests.board.emulated import Machine, ring_state  # noqa: E402

CORE_HZ = 168_000_000
CYCLES = 1.3
"""Cycles an instruction (RM0090's flash accelerator keeps most wait states away); not measured on a board."""

LINE = 800
"""Instructions of a line of bytecode. Counted on the 32-bit Arm interpreter under an emulator (all executed
instructions of a run less those of the compiled functions, per line): 770 in the cruise, 770 in the shipped motion."""

NATIVE = ("queue_steps", "begin")
NATIVE_LINE = 12
"""Instructions of a line of these. They are compiled, but call other functions, so they run on CPython here: machine
code of the first over its lines. A call in them takes CALL more."""

CALL = 250
"""Instructions of calling one compiled function from another (see host/docs/measurements.md)."""

COMPILED = (bezier, control_points, subdivision, newton, cubics, step_queue, time_law)
ALL = (*COMPILED, subintervals, interval_steps, step_generator)


class Arrays:
    """In the place of ``armtempo_board.memory.Memory``: every part is an array of its own, as the emulator wants it."""

    def take_for_processor(self, words: int) -> Any:
        """So many words."""
        return array("i", bytes(4 * words))


class Count:
    """Runs generators with their compiled functions on the emulated core, and counts."""

    def __init__(self) -> None:
        self.machine = Machine(*(Path(str(module.__file__)) for module in COMPILED))
        self.on = False
        self.verify = False
        self.lines: Counter[str] = Counter()
        self.native = 0.0
        self.longest = 0.0
        self._parts: list[Any] = []  # ring and queue
        for name in self.machine.functions:
            home = next(module for module in COMPILED if hasattr(module, name))
            replaced = self._either(name, getattr(home, name))
            for module in ALL:
                if hasattr(module, name):
                    setattr(module, name, replaced)

    def _either(self, name: str, original: Any) -> Any:
        def call(*arguments: Any) -> Any:
            if not self.on:
                return original(*arguments)
            if sys._getframe(1).f_code.co_name in NATIVE:
                self.native += CALL
            if name == "emit":
                return self._emit(original, *arguments)
            if not self.verify:
                return self.machine.run(name, *arguments)
            copies = [argument[:] if isinstance(argument, array) else argument for argument in arguments]
            values = original(*copies), self.machine.run(name, *arguments)
            assert copies == list(arguments), name
            assert values[0] is None or values[0] == values[1], name
            return values[0]

        return call

    def _emit(self, original: Any, rings: int, state: array[int], timer: array[int]) -> None:
        """``emit`` finds ring and queue by their addresses."""
        parts = [part[:] for part in self._parts] if self.verify else self._parts
        space = state[isr.SPACE]
        self.machine.run("emit", rings, ring_state(vars(isr), space, *parts), timer, beside=parts)
        if self.verify:
            original(rings, state, timer)
            assert parts == self._parts

    def walk(self, record: bytes, joint: int, skip: int, steps: int, batch: int = 512) -> dict[str, float]:
        """Instructions per step of ``steps`` steps after the first ``skip``, in batches of entries."""
        motion = Motion(record)
        subject = step_generator.StepGenerator(Arrays())
        ring = array("I", bytes(4100))
        state = ring_state(vars(isr), 0, ring, subject.queue)
        isr.set_places(state, ring, subject.queue)
        self._parts = [ring, subject.queue]
        subject.load(motion, joint, oracle.start_steps(motion, joint), 168, 20_000)
        head = self._fill(subject, state, 0, skip, batch)
        self.machine.clear()
        self.lines.clear()
        self.native = 0.0
        self.on = True
        sys.settrace(self._trace)
        try:
            end = self._fill(subject, state, head, steps, batch)
        finally:
            sys.settrace(None)
            self.on = False
        done = (end - head) // 2
        compiled = (self.machine.count + self.native) / done
        lines = self.lines.total() / done
        return {
            "steps": done,
            "compiled": compiled,
            "lines": lines,
            "all": compiled + LINE * lines,
            "longest": self.longest,
        }

    def _fill(
        self, subject: step_generator.StepGenerator, state: array[int], head: int, steps: int, batch: int
    ) -> int:
        end = head + 2 * steps
        self.longest = 0.0
        while head < end and (subject.waits() or not subject.ended):
            if subject.at_reversal and not subject.waits():
                subject.reverse()
            before = self._all()
            subject.prepare(1 << 28)
            self.longest = max(self.longest, self._all() - before)
            head += subject.write(state, head, batch, state)
        return head

    def _all(self) -> float:
        return self.machine.count + self.native + LINE * self.lines.total()

    def _trace(self, frame: FrameType, event: str, _: Any) -> Any:
        code = frame.f_code
        if "armtempo_board" not in code.co_filename or code.co_name in ("write", "waits"):
            return None
        if event == "line":
            if code.co_name in NATIVE:
                self.native += NATIVE_LINE
            else:
                self.lines[code.co_name] += 1
        return self._trace

    def kernel(self) -> float:
        """Instructions of the loop that writes a step's two entries, groups of 16 steps."""
        counts = []
        for steps in (128, 384):
            queue = array("i", bytes(4 * step_queue.QUEUE_SIZE))
            settings = {
                step_queue.FIRST: 252 << 22, step_queue.SECOND: 1 << 29, step_queue.THIRD: 1 << 29, step_queue.POWER: 9,
                step_queue.SHIFT: 13, step_queue.GROUP: 5, step_queue.STEPS: steps,
                step_queue.UNTIL_KITICKS: 1 << 28, step_queue.PULSE: 168,
            }  # fmt: skip
            for place, value in settings.items():
                queue[place] = value
            self.machine.clear()
            ring = array("I", bytes(4100))
            timer = array("I", bytes(64))
            self.machine.run("emit", 1, ring_state(vars(isr), 1022, ring, queue), timer, beside=(ring, queue))
            counts.append(self.machine.count)
        return (counts[1] - counts[0]) / 256


def measure(joints: Iterable[int] = range(3)) -> dict[str, dict[str, float]]:
    """All figures by case; ``joints``: of the shipped motion."""
    count = Count()
    cruise = motions.steady(333_000)
    figures = {"kernel": {"compiled": count.kernel()}}
    figures["cruise"] = count.walk(cruise, 0, 3_000, 33_400)
    figures["cruise"]["stretches"] = 2 * count.machine.calls["put_cubics"]
    figures["ramp"] = count.walk(motions.cruise(333_000), 0, 10_000, 10_000)
    for joint in joints:
        figures[f"shipped joint {joint + 1}"] = count.walk(motions.feeding(), joint, 0, 20_000, 128)
    return {case: {name: round(value, 3) for name, value in row.items()} for case, row in figures.items()}


def report(figures: dict[str, dict[str, float]]) -> str:
    """The figures as text."""
    lines = [f"{'per step':<18} {'compiled':>9} {'bytecode':>9} {'together':>9}  instructions"]
    for case, row in figures.items():
        rest = f"{LINE * row['lines']:9.1f} {row['all']:9.1f}" if "lines" in row else ""
        lines.append(f"{case:<18} {row['compiled']:9.1f} {rest}")
    whole = figures["cruise"]["all"]
    lines.append(
        f"\nhighest rates, all joints alike ({CORE_HZ / 1e6:.0f} MHz, {CYCLES} cycles an instruction)"
    )
    for joints, peer in ((1, "3652 k"), (3, "820 k"), (6, "")):
        rate = CORE_HZ / CYCLES / whole / joints
        lines.append(
            f"{joints} joints: {rate / 1e3:7.0f} k steps/s each"
            + (f"; Klipper, in C: {peer}" if peer else "")
        )
    load = 999_000 * whole * CYCLES / CORE_HZ
    lines.append(f"3 joints at 333 k steps/s each take {100 * load:.0f} % of the processor")
    seconds = sum(motions.INTERVALS_S[2])
    spent = sum(row["steps"] * row["all"] for case, row in figures.items() if case.startswith("shipped"))
    longest = figures["cruise"]["longest"] * CYCLES / CORE_HZ
    lines.append(
        f"the longest call of prepare() in the cruise takes {1e6 * longest:.0f} us, 256 steps {256e6 / 333e3:.0f} us"
    )
    lines.append(f"the shipped motion takes {100 * spent * CYCLES / CORE_HZ / seconds:.1f} % on average")
    return "\n".join(lines)


if __name__ == "__main__":
    if "--verify" in sys.argv:
        machine = Count()
        machine.verify = True
        for number in range(3):
            machine.walk(motions.feeding(degree=3 + 2 * (number % 2)), number, 0, 400)
        print("the same")
        sys.exit()
    if "--json" in sys.argv:
        print(json.dumps(measure([2])))
        sys.exit()
    found = measure()
    print(report(found))
    if "--store" in sys.argv:
        STORED.write_text(json.dumps(found, indent=1) + "\n")
