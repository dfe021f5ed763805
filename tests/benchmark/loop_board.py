"""Motions on the program in an emulated chip, and what each pass of its loop costs: see tests/benchmark/loop.py."""

from __future__ import annotations

import itertools
import math
import re
import struct
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np
from armtempo.deploy import program_files
from armtempo.deploy.firmware import frozen
from armtempo.encoding import encode
from armtempo.model.arm import Arm
from armtempo_shared import armrecord, wire
from armtempo_shared.limits import (
    MAX_STEP_RATE,
    MAX_STEP_RATE_SUM,
    TICK_HZ,
)
from armtempo_shared.motion import MOST_RAMP_BITS, OTHER_ENTRIES, REST_ENTRIES

from tests.benchmark import firmware
from tests.board import motions
from tests.board.scripts.rigs.arm_rows import HEAD, row

CORE_HZ = 168_000_000
CYCLES = (1.3, 2.0, 2.5)
"""Cycles an instruction: see host/docs/measurements.md."""
RATES = (5_000, 10_000, 20_000, 33_000, 50_000, 70_000, 100_000, 130_000, 160_000, 200_000, 250_000, 333_000)
CHANGE_EVERY = 8  # of a change of speed, in pairs of other commands
BRAKE = -1
RAMP_S, WHOLE_S = 0.5, 1.2
RAMPS = (TICK_HZ // 2 >> MOST_RAMP_BITS,) * (REST_ENTRIES + OTHER_ENTRIES)
"""Of motions that came with no_ramps()."""
PROBE = "firmware_loop.py"
PROBE_MANIFEST = """
include("$(PORT_DIR)/boards/manifest.py")
module("firmware_loop.py", base_path="{}", opt=3)
"""
OWN = 6_000
"""Bytes of heap for what stands in for hardware, given next to the chip's: the stack does not need them."""
COMMANDS = 60  # status and samples in turn, one every 50 ms
IN_FIRMWARE = {
    "engine": "armtempo_board.motion.engine",
    "matches": ("armtempo_board.hardware.isr", "matches"),
    "set_interval": ("armtempo_board.stepgen.interval_steps", "set_interval"),
}
"""Where the stand-ins find what they take the place of."""
_SHIFT = 7
_INSTRUCTION_NS = 1 << _SHIFT  # of QEMU's time, in which its TIM2 has a tick a nanosecond before it is scaled
_FEED, _CELL, _FED = 1, 2, 3

Row = dict[str, int]


@dataclass(frozen=True)
class Case:
    """A motion on an arm; ``start``: where its joints stand."""

    name: str
    head: Row
    rows: list[Row]
    motion: bytes
    start: list[int]
    changes: tuple[int, ...] = ()
    """Speeds that are asked for while it moves, in thousandths; 0: a pause, BRAKE: a stop."""
    first_change: int = CHANGE_EVERY
    """Pairs of other commands until the first of them."""
    every_ms: int = 50
    """Between two commands."""
    backlash: tuple[Row, ...] = ()


@dataclass(frozen=True)
class Turn:
    """Instructions of one pass of the loop, and what was done in it."""

    cost: float
    command: bool
    answer: bool
    cells: int
    """Cells taken up."""
    feeds: tuple[float, ...]
    """Instructions of each interrupt that came meanwhile and filled the rings; part of the cost."""


@dataclass(frozen=True)
class Run:
    """One motion: its turns, and when which fault ended it."""

    turns: list[Turn]
    fault: int
    seconds: float


def cruise(
    rate: int, joints: int, ramp_s: float = RAMP_S, whole_s: float = WHOLE_S, changes: tuple[int, ...] = ()
) -> Case:
    """All joints alike: up to a rate, and down again. All limit switches and two encoders are fitted."""
    flags = armrecord.FLAG_ESTOP_FITTED | armrecord.FLAG_ESTOP_ACTIVE_HIGH
    rows = [
        row(
            channel=joint,
            encoder=(0, 2)[joint] if joint < 2 else armrecord.NONE,
            max_rate=rate * 101 // 100,
            min_steps=-10_000_000,
            max_steps=10_000_000,
            limit_low=joint if joint < 3 else armrecord.NONE,
        )
        for joint in range(joints)
    ]
    motion = motions.cruise(rate, joints, ramp_s, whole_s)
    return Case(
        "cruise",
        {**HEAD, "flags": flags, "pulse_ticks": 100, "low_ticks": 100},
        rows,
        motion,
        [0] * joints,
        changes,
    )


def reversing(rate: int, joints: int, play: int, period_s: float) -> Case:
    """All joints alike: to and fro, three times, up to half of a rate; the other half crosses ``play`` steps."""
    cruising = cruise(rate, joints)
    times = np.linspace(0.0, 3.0, 25)
    swing = rate / 2 * period_s / (2.0 * np.pi)
    via = swing * (1.0 - np.cos(2.0 * np.pi * times))
    motion = motions.record([via] * joints, [np.full(len(times) - 1, period_s / 8)], 5)
    acceleration = (rate / 2) ** 2 / play
    pace = math.ceil(TICK_HZ * math.sqrt(2.0 / acceleration) / 64)
    backlash = ({"steps": play, "on_motor": 0, "spare": 0, "pace": pace},) * joints
    return replace(cruising, name="reversing", motion=motion, backlash=backlash)


def paper() -> Case:
    """The paper's motion on the shipped arm."""
    head, rows, _ = armrecord.unpack(encode.arm_record(Arm.paper()))
    flags = head["flags"] & ~armrecord.FLAG_STOP_ON_LINK_LOSS | armrecord.FLAG_ESTOP_ACTIVE_HIGH
    start = [round(rate * via) for rate, via in zip(motions.STEPS_PER_DEG, motions.VIA_DEG[0], strict=True)]
    return Case("paper", {**head, "flags": flags}, rows, motions.feeding(), start)


class Board:
    """The firmware with the program, or with files of it, built once."""

    def __init__(self, micropython: Path, folder: Path, as_files: bool = False) -> None:
        self._folder = folder
        self._as_files = as_files
        core = {f"{module}.py": text.encode() for module, text in program_files.core().items()}
        if as_files:  # for a firmware that has the stand-ins alone
            frozen.fill(
                folder / "program", {**core, "manifest.py": PROBE_MANIFEST.format(firmware.SCRIPTS).encode()}
            )
        else:
            frozen.write(folder / "program")
        _lift_limits(folder / "program")
        source = Path(__file__).with_name("loop_board.c").read_text()
        manifest = folder / "program" / frozen.MANIFEST
        self._elf = firmware.build(micropython, folder, manifest, source)
        places = firmware.symbols(self._elf)
        self._settings: dict[str, Any] = {
            name: places[name]
            for name in ("allocated", "at_compare", "at_feed", "feed_ticks", "looks_per_ms")
        }
        self._settings |= IN_FIRMWARE

    def run(self, case: Case, cycles: float) -> Run:
        """Run a motion; a fault may end it."""
        scale = round(2 * _INSTRUCTION_NS / cycles)  # TIM2 counts half the core's cycles
        settings: dict[str, Any] = {
            **self._settings,
            "prescaler": scale - 1,
            "millisecond": round(
                CORE_HZ / 1000 / cycles * _INSTRUCTION_NS * CORE_HZ / 1e9
            ),  # SysTick's clock is 168 MHz
            "session": 3,
            "every_ms": case.every_ms,
        }
        with tempfile.TemporaryDirectory(dir=self._folder) as name:
            tree = Path(name) / "files"
            _write(tree, case, settings, self._as_files)
            image = firmware.make_image(tree, "" if self._as_files else PROBE)
            if self._as_files:
                texts = {
                    path.stem: path.read_text() for path in (self._folder / "program").glob("armtempo_*.py")
                }
                image.with_suffix(firmware.SECTORS).write_bytes(
                    program_files.image_of(texts, firmware.STM32F4)
                )
            cut = Path(name) / "cut"
            cut.write_bytes(struct.pack("<i", -OWN))
            # Without ``sleep`` a run depends on nothing but its case
            said = firmware.emulate(self._elf, image, cut, "-icount", f"shift={_SHIFT},sleep=off")
        return _read(said, scale / _INSTRUCTION_NS)

    def highest(self, joints: int, cycles: float) -> tuple[int, Run | None]:
        """The highest of RATES that ends without a fault, and that motion."""
        low, high, found = -1, len(RATES), None
        while high - low > 1:
            middle = (low + high) // 2
            run = self.run(cruise(RATES[middle], joints), cycles)
            if run.fault:
                high = middle
            else:
                low, found = middle, run
        return (RATES[low] if found else 0), found


def _lift_limits(folder: Path) -> None:
    """Let the board take rates beyond those that hello states, which this is to find."""
    lifted = 0
    for path in folder.rglob("*.py"):
        text = path.read_text()
        for limit in ("step_rates.one", "step_rates.together", MAX_STEP_RATE, MAX_STEP_RATE_SUM):
            lifted += text.count(f"{limit} + {limit} // 100")
            text = text.replace(f"{limit} + {limit} // 100", "10_000_000")
        path.write_text(text)
    assert lifted == 2, lifted


def _write(tree: Path, case: Case, settings: dict[str, Any], as_files: bool) -> None:
    """The files of the flash. Encoders stand still here, so no counts belong to a step; switches are not tripped."""
    (tree / "armtempo").mkdir(parents=True)
    rows = [{**joint, "counts_num": 0, "counts_den": 1, "limit_active_high": 1} for joint in case.rows]
    record = armrecord.pack(case.head, rows, backlash=case.backlash)
    motion = bytearray(case.motion)
    struct.pack_into(f"<I{len(RAMPS)}H", motion, 12, wire.record_crc(record), *RAMPS)
    struct.pack_into("<I", motion, len(motion) - 4, crc32(motion[:-4]))
    (tree / "armtempo" / "arm.ata").write_bytes(record)
    (tree / "armtempo" / "go.atm").write_bytes(motion)
    joints = len(rows)
    session: list[tuple[str, tuple[int, ...], bytes]] = [
        ("hello", (wire.PROTOCOL_VERSION, 1), b""),
        ("home", ((1 << joints) - 1,), struct.pack(f"<{joints}i", *case.start)),
        ("start", (0, wire.record_crc(bytes(motion))), b"go"),
    ]
    changes = iter(case.changes)
    for number in range(COMMANDS // 2):
        session += [("status", (), b""), ("samples", (number, 0), b"")]
        if (number + 1 - case.first_change) % CHANGE_EVERY == 0 and number + 1 >= case.first_change:
            for rate in itertools.islice(changes, 1):
                session.append(("stop", (0,), b"") if rate == BRAKE else ("speed", (rate,), b""))
    with (tree / "frames").open("wb") as file:
        for sequence, (name, values, tail) in enumerate(session):
            entry = wire.COMMAND[name]
            frame = wire.frame(sequence, entry[1], wire.encode(entry, values, tail))
            file.write(struct.pack("<H", len(frame)) + frame)
    module = Path(PROBE).stem if as_files else "probe"
    probe = (
        f"import {module} as probe\n\nprobe.replace({settings!r})\n{firmware.START}, load_program\n\nload_program()\n"
        "probe.hook()\n"
    )
    for path, data in program_files.start_files().items():
        (tree / Path(path).name).write_text(data.decode().replace(firmware.START, probe))
    if as_files:
        for path, data in program_files.library(firmware.STM32F4).items():
            local = tree / path.removeprefix(f"{program_files.ROOT}/")
            local.parent.mkdir(parents=True)
            local.write_bytes(data)


def _read(said: str, scale: float) -> Run:
    """``scale``: instructions a tick. The turns in which the motion begins and ends are left out."""
    lines = re.findall(r"^@ turn (\d+) (\d) (\d)((?: \d+)*)$", said, re.MULTILINE)
    turns = [
        _turn(int(took), command == "1", answer == "1", log, scale) for took, command, answer, log in lines
    ]
    parser = wire.Parser()
    parser.feed(bytes.fromhex("".join(re.findall(r"@ answer (\w+)", said))))
    ends = []
    for _, number, payload in iter(parser.next, None):
        name, *_ = entry = wire.EVENT_BY_ID[number]
        values, _ = wire.decode(entry, payload)
        if name == "notice":  # of an exception in the program, after the fault
            print(payload.decode())
        elif name == "done":
            ends.append(Run(turns[1:-1], 0, values[1] / TICK_HZ))
        elif name == "fault":
            ends.append(Run(turns[1:-1], values[1], values[3] / TICK_HZ))
    assert ends, said[-2000:]
    return ends[0]


def _turn(took: int, command: bool, answer: bool, log: str, scale: float) -> Turn:
    numbers = [int(word) for word in log.split()]
    entries = [(what >> 16, time * scale) for what, time in zip(numbers[::2], numbers[1::2], strict=True)]
    feeds = [
        end - begin
        for (what, begin), (after, end) in itertools.pairwise(entry for entry in entries if entry[0] != _CELL)
        if (what, after) == (_FEED, _FED)
    ]
    cells = sum(what == _CELL for what, _ in entries)
    return Turn(took * scale, command, answer, cells, tuple(feeds))
