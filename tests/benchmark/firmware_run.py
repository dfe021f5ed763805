"""The shipped motion on MicroPython's own stm32 firmware, driven by this host: host/docs/measurements.md.

    python -m tests.benchmark.firmware_run MICROPYTHON [FOLDER]

MICROPYTHON: a checkout as ``armtempo firmware`` takes it. That command builds the firmware with the program; one
without is built next to it, and gets the compiled files that ``armtempo deploy`` copies. QEMU (7.2 or newer) runs each;
the host reaches it over TCP, sends the arm, homes it, uploads the motion and runs it, as with any board; in the
firmware once more with backlash. Then README's commands for one are run, but for those that write the flash, with
encoders that are not watched. What stands in for timers, DMA, USB, encoders and backup SRAM (loop_board.c,
firmware_loop.py, firmware_host.py of tests/board/scripts) is a part of both firmwares, so that it takes little of the
heap; what it takes is given next to the chip's. FOLDER keeps what was built.
"""

from __future__ import annotations

import re
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from armtempo.basics.arrays import Array
from armtempo.basics.errors import ArmtempoError
from armtempo.deploy import program_files
from armtempo.encoding import encode, encoded_plan
from armtempo.model import shipped
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.parts import LimitSwitches, Safety
from armtempo.planning import planner
from armtempo.robot.board import Board
from armtempo.robot.connect import connect
from armtempo_shared.limits import TICK_HZ
from armtempo_shared.motion import Motion
from numpy.typing import NDArray

from tests.benchmark import firmware, loop_board
from tests.board import oracle
from tests.system import commandline
from tests.system.test_examples import README, command_lines

PROBES = ("firmware_loop.py", "firmware_host.py")
MANIFEST = 'include("$(PORT_DIR)/boards/manifest.py")\n' + "".join(f'module("{name}")\n' for name in PROBES)
CYCLES = 1.3
OWN = loop_board.OWN + 3_100
"""Bytes of heap for what stands in for hardware, as in loop: what is received takes more."""
PATIENCE_S = 300.0
FIRST_COMPARE = 0x40000034
"""Address of TIM2's first compare register."""
SIX_JOINTS = "ar4"
IN_FIRMWARE = "in the firmware"
BACKLASH_DEG = 0.3
CROSSED_LATE_S = 0.05
"""A crossing begins 25 ms after the loop has seen the reversal."""
USB = 'pyb.usb_mode("VCP")'
START = """import gc

gc.collect()
before = gc.mem_alloc()
import firmware_host

firmware_host.replace(%r)
gc.collect()
print("@ own", gc.mem_alloc() - before)
from armtempo_board import load_program

program = load_program()
firmware_host.loop.hook()
program.main(firmware_host.ROOT)
"""


@dataclass(frozen=True)
class Heap:
    """Bytes: in use by firmware and program, and the largest free block."""

    used: int
    largest: int


def define_board(micropython: Path, folder: Path) -> Path:
    """The definition of the emulated board, with the stand-ins as modules of its firmware."""
    source = Path(__file__).with_name("loop_board.c").read_text()
    probes = {name: (firmware.SCRIPTS / name).read_text() for name in PROBES}
    return firmware.define_board(micropython, folder, source, {**probes, "manifest.py": MANIFEST})


def build_with_program(micropython: Path, board: Path, out: Path) -> Path:
    """By the command; the firmware's ELF file."""
    if not out.exists():
        command = [
            sys.executable,
            "-m",
            "armtempo",
            "firmware",
            "--board",
            board,
            "--micropython",
            micropython,
            "--out",
            out,
        ]
        subprocess.run(list(map(str, command)), check=True)
    return out / "firmware.elf"


def flash(folder: Path, elf: Path, with_library: bool, edges: bool = True) -> Path:
    """The image of a flash whose main.py starts the program between the stand-ins.

    ``edges``: they tell of all edges, and collect the heap then.
    """
    places = firmware.symbols(elf)
    scale = round(2 * loop_board._INSTRUCTION_NS / CYCLES)
    settings: dict[str, Any] = {
        name: places[name] for name in ("allocated", "at_compare", "at_feed", "feed_ticks", "looks_per_ms")
    }
    settings |= loop_board.IN_FIRMWARE
    settings |= {
        "edges": edges,
        "prescaler": scale - 1,
        "millisecond": round(
            loop_board.CORE_HZ / 1000 / CYCLES * loop_board._INSTRUCTION_NS * loop_board.CORE_HZ / 1e9
        ),
    }
    tree = folder / ("files" if with_library else "no-files")
    files = program_files.start_files()
    if with_library:
        files |= program_files.library(firmware.STM32F4)
    for path, data in files.items():
        local = tree / path.removeprefix(f"{program_files.ROOT}/")
        local.parent.mkdir(parents=True, exist_ok=True)
        local.write_bytes(data)
    boot = (tree / "boot.py").read_text()
    assert USB in boot
    # The emulator has none, and waits long
    (tree / "boot.py").write_text(boot.replace(USB, "pyb.usb_mode(None)"))
    before, found, _ = (tree / "main.py").read_text().partition(firmware.START)
    assert found
    (tree / "main.py").write_text(before + START % settings)
    return firmware.make_image(tree)


@contextmanager
def running(elf: Path, image: Path, more_heap: int = OWN) -> Iterator[tuple[str, list[str]]]:
    """A board that runs: its port for the host, and the lines that it has printed until now.

    ``more_heap``: bytes beyond the chip's heap, for what stands in for hardware; they are the end of the stack.
    """
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        number = probe.getsockname()[1]
    serial = f"tcp:127.0.0.1:{number},server=on,wait=off,nodelay=on"
    with tempfile.NamedTemporaryFile() as cut:
        cut.write(struct.pack("<i", -more_heap))
        cut.flush()
        command = firmware.emulator(elf, image, Path(cut.name), "-icount", f"shift={loop_board._SHIFT}")
        command += ["-serial", serial]
        said: list[str] = []
        with subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        ) as process:
            threading.Thread(target=lambda: said.extend(process.stdout or ()), daemon=True).start()
            try:
                _wait(said, "@ started")
                yield f"socket://127.0.0.1:{number}", said
            finally:
                process.kill()


def _wait(said: list[str], words: str) -> None:
    begin = time.monotonic()
    while not any(words in line for line in said):
        assert time.monotonic() - begin < PATIENCE_S, "".join(said)
        time.sleep(0.2)


def heaps(said: list[str]) -> dict[str, Heap]:
    """By stage."""
    text = "".join(said).replace("\r", "")
    (own,) = re.findall(r"@ own (\d+)", text)
    assert 0 <= OWN - int(own) < 500, own
    found = re.findall(r"@ (\w+)\nstack.*\nGC: total: \d+, used: (\d+).*\n.*max free sz: (\d+)", text)
    return {name: Heap(int(used) - int(own), 16 * int(free)) for name, used, free in found}


def worst_edge(record: bytes, said: list[str]) -> float:
    """Largest distance in ticks of a rising edge from where the spline passes half a step, above 50 steps/s.

    ``said``: what a board with ``edges`` printed during the motion. AssertionError if there are more or fewer edges.
    """
    motion, worst = Motion(record), 0.0
    for joint, ticks in enumerate(rising_edges(said, motion.joints)):
        exact = oracle.without_grazes(oracle.crossings(motion, joint), oracle.GAP_TICKS)
        assert len(ticks) == len(exact.ticks), (joint, len(ticks), len(exact.ticks))
        worst = max(worst, float(np.max(np.abs(_off(ticks, exact.ticks)[exact.speed > 50]))))
    return worst


def rising_edges(said: list[str], joints: int) -> list[NDArray[np.int32]]:
    """Of each joint, in ticks: what a board with ``edges`` printed during a motion."""
    data = bytes.fromhex("".join(re.findall(r"@ edges (\w+)", "".join(said))))
    rows = np.frombuffer(data, dtype="<i4").reshape(-1, 2)
    return [rows[rows[:, 0] == FIRST_COMPARE + 4 * joint, 1][::2] for joint in range(joints)]


def _off(ticks: NDArray[np.int32], exact: Array) -> Array:
    """Distance of edges from where they should be; the counter wraps."""
    return (ticks - exact + (1 << 31)) % (1 << 32) - (1 << 31)


def check_crossings(record: bytes, said: list[str], arm: Arm) -> str:
    """What a joint's edges show, which reverses at most once: AssertionError unless all are those of its spline, and
    as many more as its play has, between the reversal and the end of the crossing."""
    motion, found = Motion(record), []
    for joint, ticks in enumerate(rising_edges(said, motion.joints)):
        exact = oracle.without_grazes(oracle.crossings(motion, joint), oracle.GAP_TICKS)
        crossing, steps = arm.crossings[joint], encode.backlash(arm)[joint]["steps"]
        turned = [*np.flatnonzero(np.diff(exact.direction)), len(exact.ticks) - 1]
        assert len(turned) <= 2, joint
        assert crossing is not None
        before = turned[0] + 1
        crossed_ticks = exact.ticks[turned[0]] + (crossing.duration_s + CROSSED_LATE_S) * TICK_HZ
        after = int(np.count_nonzero(exact.ticks > crossed_ticks)) if len(turned) > 1 else 0
        assert len(ticks) == len(exact.ticks) + steps * (len(turned) - 1), (
            joint,
            len(ticks),
            len(exact.ticks),
        )
        own = np.concatenate((ticks[:before], ticks[len(ticks) - after :]))
        where = np.concatenate((np.arange(before), np.arange(len(exact.ticks) - after, len(exact.ticks))))
        off = np.abs(_off(own, exact.ticks[where])[exact.speed[where] > 50])
        assert np.max(off) < 2.0, (joint, np.max(off))
        least_us = float(np.min(np.diff(ticks))) / TICK_HZ * 1e6
        found.append(
            f"joint {joint + 1} {len(ticks)}, of them {len(ticks) - len(exact.ticks)} of its play, {least_us:.0f} us"
        )
    return "; ".join(found)


def unwatched(arm: Arm) -> Arm:
    """The arm without what nothing stands in for: encoders are not watched, there are no switches."""
    joints = tuple(
        replace(
            joint,
            encoder=joint.encoder and replace(joint.encoder, following_error_deg=0.0),
            switches=LimitSwitches(),
        )
        for joint in arm.joints
    )
    return replace(arm, joints=joints, safety=Safety())


def run(elf: Path, image: Path, backlash_deg: float = 0.0) -> dict[str, Heap]:
    """Drive a board through the shipped motion by the host's own link; AssertionError if it does not end well.

    ``backlash_deg``: of each joint.
    """
    arm = with_backlash(unwatched(Arm.paper()), backlash_deg)
    plan = planner.plan(arm, replace(Job.paper(arm), population=5, iterations=20))
    with running(elf, image) as (port, said), tempfile.TemporaryDirectory() as runs:
        with connect(port) as board:
            board.home(arm)
            board.goto(plan)
            before = len(said)
            done = board.run(plan, out=runs)
            _check_steps(board, arm, plan.trajectory(plan.total_s))
        print(f"    {plan.job.name}: {plan.total_s:.3f} s, {len(done.samples)} samples, ends where planned")
        _wait(said, "@ ended")
        record = encoded_plan.of_plan(plan).data
        if backlash_deg:
            edges = check_crossings(record, said[before:], arm)
            print(f"    pulses with {backlash_deg} deg of backlash, and the least time between two: {edges}")
        else:
            error = worst_edge(record, said[before:])
            print(
                f"    pulses: one for each half step that the spline passes, at most {error:.2f} ticks from it"
            )
        return heaps(said)


def with_backlash(arm: Arm, backlash_deg: float) -> Arm:
    """The arm with this backlash of each motor."""
    joints = [
        replace(joint, motor=joint.motor and replace(joint.motor, backlash_deg=backlash_deg))
        for joint in arm.joints
    ]
    return replace(arm, joints=tuple(joints))


def readme(elf: Path, image: Path) -> None:
    """README's commands for a real board, each to end with 0: prints what the run ended with."""
    (block,) = [each for each in command_lines(README) if ["armtempo", "flash"] in each]
    with running(elf, image) as (port, _), tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        arm = folder / "paper.toml"
        text = shipped.arm_path().read_text(encoding="utf-8")
        arm.write_text(text.replace("following_error_deg = 2.0", "following_error_deg = 0.0"))
        for _, command, *words in block:
            if command in ("flash", "deploy") or words == []:
                continue
            arguments = [command, *(str(arm) if word == "paper" else word for word in words)]
            if command == "plan":
                arguments += ["--arm", str(arm), "--job", str(shipped.job_path())]
            done = commandline.run(*arguments, folder=folder, ARMTEMPO_PORT=port)
            assert done.exit_code == 0, f"{command}: {done.output}{done.errors}"
        print(f"    README: {done.output.splitlines()[-1]}", flush=True)


def move(elf: Path, image: Path, name: str) -> dict[str, Heap]:
    """Move a shipped arm a little from its home posture; as ``run``."""
    arm = unwatched(Arm.load(name))
    target_deg = np.array(arm.home_deg) + np.resize([2.0, 1.0, -2.0], len(arm.driven))
    with running(elf, image) as (port, said):
        with connect(port) as board:
            board.home(arm)
            board.goto(target_deg)
            _check_steps(board, arm, target_deg)
        _wait(said, "@ ended")
        return heaps(said)


def _check_steps(board: Board, arm: Arm, angles_deg: Array) -> None:
    wanted = [
        round(float(angle) * joint.steps_per_deg) for angle, joint in zip(angles_deg, arm.driven, strict=True)
    ]
    sent = board.status().positions.commanded_steps
    assert max(abs(one - two) for one, two in zip(sent, wanted, strict=True)) <= 1, (sent, wanted)


def both_ways(micropython: Path, folder: Path) -> Iterator[tuple[str, Path, Path]]:
    """The program in the firmware, and as compiled files: a title, the firmware's ELF file, the image of its flash."""
    board = define_board(micropython, folder)
    elf = build_with_program(micropython, board, folder / "with-program")
    yield IN_FIRMWARE, elf, flash(folder, elf, with_library=False)
    elf = firmware.build_at(micropython, board, folder / "stock")
    yield "files, compiled", elf, flash(folder, elf, with_library=True)


def main(micropython: Path, folder: Path) -> None:
    """Print the figures."""
    for title, elf, image in both_ways(micropython, folder):
        print(title, flush=True)
        tell(run(elf, image))
        if title == IN_FIRMWARE:
            tell(run(elf, image, BACKLASH_DEG))
        readme(elf, image)
        print(f"    {SIX_JOINTS}, six joints:", flush=True)
        try:
            tell(move(elf, image, SIX_JOINTS))
        except ArmtempoError as error:
            print(f"    {error}")


def tell(found: dict[str, Heap]) -> None:
    """Print a line for each stage."""
    for stage, heap in found.items():
        print(f"    {stage:<10}in use {heap.used:>7}, largest free block {heap.largest:>7}", flush=True)


def start(main: Callable[[Path, Path], None]) -> None:
    """With the arguments MICROPYTHON [FOLDER]; without FOLDER nothing is kept."""
    with tempfile.TemporaryDirectory() as name:
        main(Path(sys.argv[1]).resolve(), Path(sys.argv[2] if len(sys.argv) > 2 else name).resolve())


if __name__ == "__main__":
    start(main)
