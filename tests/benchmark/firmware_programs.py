"""Programs, and all else that moves, on MicroPython's own stm32 firmware: host/docs/measurements.md.

    python -m tests.benchmark.firmware_programs MICROPYTHON [FOLDER]

MICROPYTHON, FOLDER and how it is run: tests/benchmark/firmware_run.py. A jog, a goto that is paused, slowed down and
stopped, and a sequence; then users' programs, each to end as host/docs/programs.md says. AssertionError if not.
"""

from __future__ import annotations

import tempfile
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from armtempo.basics.errors import BoardError
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.outputs import Input, Output
from armtempo.model.parts import LimitSwitches
from armtempo.planning import planner
from armtempo.robot.board import Board
from armtempo.robot.connect import connect
from armtempo.robot.stop_request import Stopped, StopRequest

from tests.benchmark import firmware_run
from tests.system import sequences

PAPER = firmware_run.unwatched(Arm.paper())
SWITCHES = iter(("PC1", "PC2", "PC3"))
ARM = replace(
    PAPER,
    joints=tuple(
        replace(joint, switches=LimitSwitches(low=next(SWITCHES), low_deg=joint.range_deg[0]))
        if joint.motor
        else joint
        for joint in PAPER.joints
    ),
    outputs=(Output("gripper", "switch", "PB8", 0.0, (("open", 0.0), ("closed", 1.0))),),
    inputs=(Input("part", "PD0", "low"), Input("full", "PD1", "high")),
)
"""All inputs are low, and all switches pressed."""
THERE = Job("there", (ARM.home_deg, (2.0, -59.0, 42.0)), path="through", population=5, iterations=20)
AWAY = "[3, -58, 38]"
HEAD = "from armtempo_board import cell\n"


PIECE = 256
HOMES = """{}keep = [bytearray(240) for _ in range({})]
try:
    cell.home()
except cell.Error as error:
    print(error)
"""
HOLDS = """{}keep = [bytearray(240) for _ in range({})]
cell.goto([2, -59, 42])
cell.goto("home", speed=0.5)
cell.run("there")
cell.set("gripper", "closed", wait_s=0.1)
print(cell.wait("part"), cell.count("parts"))
"""


@dataclass(frozen=True)
class Case:
    """A program, how it ends, and what it says: a part of it."""

    source: str
    ending: str = "finished"
    """Or the names of faults, one of which ends it."""
    line: int = 0
    said: tuple[str, ...] = ()
    stop_at: str = ""
    """It is stopped when it says this."""


CASES = {
    "calls": Case(
        f"cell.goto({AWAY})\nprint('at', cell.posture())\ncell.set('gripper', 'closed', wait_s=0.1)\n"
        "print(cell.wait('part'), cell.wait('full', timeout_s=0.1), cell.count('parts'))\n"
        "cell.goto('home', speed=0.5)\ncell.run('there')\ncell.goto('home')\n",
        said=("at [3.0", "True False 1"),
    ),
    "refused": Case(
        "for target in ('nowhere', [300, 0, 0]):\n    try:\n        cell.goto(target)\n"
        "    except cell.Error as error:\n        print(error)\n",
        said=("no posture 'nowhere'", "joint 1 would leave its range"),
    ),
    "raises": Case(
        f"def move():\n    cell.goto({AWAY}, wait=False)\n    cell.sleep(0.1)\n    return [][3]\n\nmove()\n",
        "program_failed",
        5,
        ('"raises.py", line 5, in move', "IndexError"),
    ),
    "allocates": Case(
        f"cell.goto({AWAY}, wait=False)\nn = 0\nwhile cell.moving():\n"
        "    rows = [bytearray(100) for _ in range(20)]\n    n += 1\nprint(n > 20)\ncell.goto('home')\n",
        said=("True",),
    ),
    "tasks": Case(
        "import asyncio\nasync def main():\n    task = asyncio.create_task(cell.serve())\n"
        f"    cell.goto({AWAY}, wait=False)\n    while cell.moving():\n        await asyncio.sleep_ms(5)\n"
        "    task.cancel()\n    print('there')\nasyncio.run(main())\ncell.goto('home')\n",
        said=("there",),
    ),
    "endless": Case(
        f"cell.goto({AWAY}, wait=False)\nprint('loops')\nwhile True:\n    pass\n",
        "stopped",
        4,
        stop_at="loops",
    ),
    "blocks": Case(
        f"import time\ncell.goto({AWAY}, wait=False)\ncell.sleep(0.2)\ntime.sleep_us(300000)\nprint(1)\n",
        "underrun",
        4,
    ),
    "fills": Case(
        f"cell.goto({AWAY}, wait=False)\nkeep = []\nwhile True:\n    keep.append(bytearray(1000))\n",
        "program_failed",
        5,
        ("MemoryError",),
    ),
    "fills_slowly": Case(
        f"cell.goto({AWAY}, wait=False)\nkeep = []\nwhile True:\n    keep.append([1])\n",
        "program_failed underrun",  # the last bytes cost a collection each
        0,
        ("MemoryError",),
    ),
    "homes": Case("cell.home()\n", "program_failed", 2, ("joint 1: its limit switch is still pressed",)),
}
RECURSES = {
    "fills": CASES["fills"],
    "recurses": Case("def f(n):\n    return f(n + 1) + 1\n\nf(0)\n", "program_failed", 3, ("RuntimeError",)),
    "recurses_in_cell": Case(
        "def f(n):\n    cell.moving()\n    return f(n + 1) + 1\n\nf(0)\n",
        "program_failed",
        0,
        ("RuntimeError",),
    ),
}
"""In the stack as it is on the chip, which elsewhere has lost what the heap has more; the heap is smaller then."""


def run_case(board: Board, name: str, case: Case, folder: Path) -> str:
    """Run it; how it ends, and what it says."""
    path = folder / f"{name}.py"
    path.write_text(HEAD + case.source)
    said: list[str] = []
    stop = StopRequest()

    def listen(text: str) -> None:
        said.append(text)
        if case.stop_at and case.stop_at in text:
            stop.ask("the benchmark")

    with suppress(Stopped, BoardError):
        board.run_program(path, listen, stop=stop)
    end = board.client.sequence()
    found = board.state()
    text = "\n".join(said)
    assert (found.fault or end.ending) in case.ending.split(), (end, found.fault, text)
    assert not case.line or end.step == case.line, (end, text)
    assert all(part in text for part in case.said), text
    assert all(joint.known for joint in found.joints) or name == "homes"
    board.clear()
    if name == "homes":
        board.home(ARM)
    board.goto("home")
    return f"{found.fault or end.ending}; says {text!r}"


def beyond(board: Board, angle_deg: float, call: Callable[[], object]) -> threading.Thread:
    """Call it from another thread when joint 1 is beyond an angle."""

    def wait() -> None:
        while board.posture_deg()[0] <= angle_deg:
            time.sleep(0.02)
        call()

    thread = threading.Thread(target=wait)
    thread.start()
    return thread


def moves(board: Board) -> None:
    """A jog, pause, resume, another speed, a stop."""
    board.jog(1, 2.0, speed=1.0)
    assert abs(board.posture_deg()[0] - 2.0) < 0.02
    board.goto("home")
    stands: list[float] = []

    def pause() -> None:
        board.pause()
        while len(stands) < 2 or stands[-1] != stands[-2]:
            stands.append(board.posture_deg()[0])
            time.sleep(1.0)
        board.resume()
        board.speed(0.5)

    thread = beyond(board, 2.0, pause)
    board.goto([20.0, -60.0, 40.0])
    thread.join()
    assert 2.0 < stands[-1] < 19.0, stands
    board.speed(1.0)
    np.testing.assert_allclose(board.posture_deg()[:3], [20.0, -60.0, 40.0], atol=0.02)
    board.goto("home")
    stop = StopRequest()
    thread = beyond(board, 2.0, lambda: stop.ask("the benchmark"))
    with suppress(Stopped):
        board.goto([20.0, -60.0, 40.0], stop=stop)
    thread.join()
    assert 2.0 < board.posture_deg()[0] < 19.0, board.posture_deg()
    board.goto("home")


def sequence(board: Board, folder: Path) -> None:
    """Two passes of pick and place."""
    plan = sequences.small(folder, 2, arm=ARM)
    end = board.run_sequence(plan, out=folder / "runs")
    assert (end.ending, end.cycle) == ("finished", 2), end


def spare(board: Board, folder: Path, program: str = HOLDS) -> int:
    """The most bytes, in pieces, that a program with all kinds of calls can hold; to 512."""
    low, high = 0, 256
    while high - low > 2:
        middle = (low + high) // 2
        (folder / "holds.py").write_text(program.format(HEAD, middle))
        try:
            low = middle if board.run_program(folder / "holds.py").ending == "finished" else low
        except BoardError:
            high = middle
            board.clear()
        if program == HOMES:
            board.home(ARM)  # nothing is known after it, as the switches are pressed
        board.goto("home")
    return low * PIECE


def main(micropython: Path, folder: Path) -> None:
    """Print a line for each case."""
    chip = firmware_run.define_board(micropython, folder)
    elf = firmware_run.build_with_program(micropython, chip, folder / "with-program")
    image = firmware_run.flash(folder, elf, with_library=False, edges=False)
    with (
        firmware_run.running(elf, image) as (port, _),
        tempfile.TemporaryDirectory() as name,
        connect(port) as board,
    ):
        board.home(ARM)
        print(f"the arm is set up: {board.client.hello().free_heap} bytes free", flush=True)
        moves(board)
        print(
            f"jog, pause, resume, half the speed, stop: {board.client.hello().free_heap} bytes free",
            flush=True,
        )
        sequence(board, Path(name))
        print(f"sequence: {board.client.hello().free_heap} bytes free", flush=True)
        board.upload(planner.plan(ARM, THERE))
        free = board.client.hello().free_heap
        held = spare(board, Path(name))
        while_homing = spare(board, Path(name), HOMES)
        print(
            f"{free} bytes free; a program can hold {held}, and one that homes the arm {while_homing}",
            flush=True,
        )
        for case, program in CASES.items():
            free = board.client.hello().free_heap
            ended = run_case(board, case, program, Path(name))
            print(f"{case}: {free} bytes free before; {ended}", flush=True)
        print(f"afterwards {board.client.hello().free_heap} bytes are free", flush=True)
    with (
        firmware_run.running(elf, image, more_heap=0) as (port, _),
        tempfile.TemporaryDirectory() as name,
        connect(port) as board,
    ):
        board.home(ARM)
        for case, program in RECURSES.items():
            print(f"{case}: {run_case(board, case, program, Path(name))}", flush=True)


if __name__ == "__main__":
    firmware_run.start(main)
