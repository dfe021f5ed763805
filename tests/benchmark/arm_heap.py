"""The heap that every arm leaves on MicroPython's own STM32F407 firmware: the tables of host/docs/measurements.md.

    python -m tests.benchmark.arm_heap MICROPYTHON [CHANGES]

MICROPYTHON and how it is run: tests/benchmark/firmware.py. The program, on it and within the firmware, is driven by
a host's frames: for each arm it is started afresh, gets the arm, a motion, home, start and stop. CHANGES: then, in one
start of the program, that many random arms (1 to 6 joints, 1000 to 240 000 steps/s), each with an upload, a run and a
removal; more than 40 are up to 40 different ones, again and again.
"""

from __future__ import annotations

import random
import re
import struct
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from zlib import crc32

from armtempo.deploy import program_files
from armtempo.deploy.firmware import frozen
from armtempo.deploy.program_files import STM32F4
from armtempo_shared import armrecord, engine_memory, wire
from armtempo_shared.limits import MAX_MOTION_BYTES
from armtempo_shared.messages import MAX_COMMAND, ONCE_NAME

from tests import interpreters
from tests.benchmark import firmware
from tests.board import motions
from tests.board.scripts.rigs.arm_rows import HEAD, row

ARMS = tuple((joints, rate) for joints in (1, 3, 6) for rate in (5_000, 25_000, 80_000))
ARMS += ((1, 240_000), (2, 120_000), (3, 60_000), (6, 40_000))
FLASH_CACHE = interpreters.VIRTUAL / "hardware" / "chip" / "flash_cache.py"
LIMIT_S = 300.0
_STAGE = 0x8000
_BLOCK = 512
_MOST_ARMS = 10  # whose frames the emulated flash has space for; more come from sending them again
_PIECE = MAX_COMMAND - 4
OWN = 2_400
"""Bytes of heap for what this benchmark itself has in it, given next to the chip's: the stack does not need them."""
_DISK_BLOCKS = firmware.FLASH_BLOCKS
USUAL = 'include("$(PORT_DIR)/boards/manifest.py")\n'
_SEMIHOSTING = ("-semihosting-config", "enable=on,target=native")
_MOUNT = f"""import host_disk

host_disk.mount("/flash/armtempo", {_DISK_BLOCKS})
"""


@dataclass
class Session:
    """What a host sends."""

    data: bytearray = field(default_factory=bytearray)
    sent: list[str] = field(default_factory=list)
    rounds: int = 1
    """How often all is sent, but for the first command."""

    def command(self, name: str, values: tuple[int, ...] = (), tail: bytes = b"") -> None:
        """One frame."""
        entry = wire.COMMAND[name]
        frame = wire.frame(len(self.sent) & 0xFF, entry[1], wire.encode(entry, values, tail))
        self.sent.append(name)
        self.data += struct.pack("<H", len(frame)) + frame

    def stage(self, name: str) -> None:
        """The heap is measured here."""
        self.data += struct.pack("<H", _STAGE + len(name)) + name.encode()

    def upload(self, name: str, record: bytes) -> None:
        """A record."""
        self.command("put_begin", (len(record), wire.record_crc(record)), name.encode())
        for at in range(0, len(record), _PIECE):
            self.command("put_data", (at,), record[at : at + _PIECE])
        self.command("put_commit", (wire.record_crc(record),))

    def run(self, arm: bytes, motion: bytes) -> None:
        """The arm gets its record, and the motion is begun and frozen."""
        self.upload(wire.ARM_RECORD_NAME, arm)
        self.stage("configured")
        self.upload("go", motion)
        self.start(arm, motion)

    def start(self, arm: bytes, motion: bytes) -> None:
        """The motion that is stored is begun and frozen."""
        joints = arm[5]
        self.command("home", ((1 << joints) - 1,), bytes(4 * joints))
        self.command("list", (0,))
        self.stage("uploaded")
        self.command("start", (0, wire.record_crc(motion)), b"go")
        self.stage("moving")
        self.command("stop", (1,))
        self.command("clear")
        once = motion_record(arm, 20)
        for at in range(0, len(once), _PIECE):
            self.command("put_once", (at, len(once)), once[at : at + _PIECE])
        self.command("start", (0, wire.record_crc(once)), ONCE_NAME.encode())
        self.stage("once")
        self.command("stop", (1,))


def arm_record(rates: list[int]) -> bytes:
    """An arm of that many joints; encoders and switches stand still in the emulator."""
    rows = [row(channel=n, max_rate=rate, counts_num=0, counts_den=1) for n, rate in enumerate(rates)]
    return armrecord.pack({**HEAD, "identity": 1}, rows)


def motion_record(arm: bytes, segments: int) -> bytes:
    """A slow motion of all joints in that many segments, from 0, that may brake."""
    total_s = 0.1 * segments
    motion = bytearray(motions.cruise(100.0, arm[5], total_s / 2, total_s))
    struct.pack_into("<I64H", motion, 12, wire.record_crc(arm), *[6] * 64)
    struct.pack_into("<I", motion, len(motion) - 4, crc32(motion[:-4]))
    return bytes(motion)


@dataclass(frozen=True)
class Outcome:
    """What the board said: stages with (in use, largest free block) in bytes, and its replies."""

    stages: list[tuple[str, int, int]]
    replies: list[tuple[str, Any]]
    said: str

    @property
    def erasures(self) -> dict[str, str]:
        """The sectors erased before each stage, since the one before."""
        parts = re.findall(r"((?:.*\n)*?)@ (\w+)\r?\nstack", self.said)
        found = {stage: "".join(re.findall(r"@ erased (\d)", said)) for said, stage in parts}
        return {stage: sectors for stage, sectors in found.items() if sectors}

    @property
    def refusals(self) -> list[tuple[int, str, int]]:
        """(number of the command, code, value) of what was refused."""
        return [
            (number, wire.ERRORS[values[1]][0], values[3])
            for number, (name, values) in enumerate(self.replies)
            if name == "error"
        ]


def build(micropython: Path, folder: Path, manifest: Path | None) -> Path:
    """Build a firmware that has what measures in it, so that its names and code take none of the heap."""
    scripts = {"probe.py": "firmware_heap.py", "host_disk.py": "host_disk.py", "flash_cache.py": FLASH_CACHE}
    files = {name: (firmware.SCRIPTS / script).read_text() for name, script in scripts.items()}
    files["manifest.py"] = USUAL + "".join(f'module("{name}")\n' for name in scripts)
    return firmware.build(micropython, folder, manifest, files=files)


def drive(elf: Path, with_library: bool, *sessions: Session, limit_s: float = LIMIT_S) -> list[Outcome]:
    """Start the program on a firmware with an empty store, and let it have a session; again for each further one."""
    with tempfile.TemporaryDirectory() as name:
        (Path(name) / "disk").write_bytes(bytes(512 * _DISK_BLOCKS))
        return [_drive(elf, with_library, session, Path(name), limit_s) for session in sessions]


def _drive(elf: Path, with_library: bool, session: Session, folder: Path, limit_s: float) -> Outcome:
    """Start the program on a firmware, with the store in the folder's ``disk``, and let it have the session."""
    tree = folder / "tree"
    for path, data in _files(with_library).items():
        (tree / path).parent.mkdir(parents=True, exist_ok=True)
        (tree / path).write_bytes(data)
    (tree / "frames").write_bytes(session.data)
    (tree / "rounds").write_text(str(session.rounds))
    image = firmware.make_image(tree)
    cut = folder / "cut"
    cut.write_bytes(struct.pack("<i", -OWN))
    said = firmware.emulate(elf, image, cut, *_SEMIHOSTING, limit_s=limit_s)
    return _outcome(said)


def _files(with_library: bool) -> dict[str, bytes]:
    files = dict(program_files.start_files())
    if with_library:
        files |= program_files.library(STM32F4)
    found = {path.removeprefix(f"{program_files.ROOT}/"): data for path, data in files.items()}
    found["main.py"] = (
        found["main.py"]
        .decode()
        .replace(firmware.START, firmware.PROBE.replace(firmware.BEFORE, firmware.BEFORE + _MOUNT))
        .encode()
    )
    return found


def _outcome(said: str) -> Outcome:
    own = re.search(r"@ own (\d+)", said)
    assert own, said[-2000:]
    assert abs(OWN - int(own[1])) < 600, own
    found = re.findall(r"@ (\w+)\nstack.*\nGC: total: \d+, used: (\d+).*\n.*max free sz: (\d+)", said)
    parser = wire.Parser()
    parser.feed(bytes.fromhex("".join(re.findall(r"@ answer (\w+)", said))))
    replies = []
    for _, number, payload in iter(parser.next, None):
        name, *_ = entry = wire.EVENT_BY_ID[number]
        if name in ("ok", "error"):
            replies.append((name, wire.decode(entry, payload)[0]))
        elif name == "notice":
            print(payload.decode())
    return Outcome(
        [(name, int(used) - int(own[1]), 16 * int(free)) for name, used, free in found], replies, said
    )


def table(elf: Path, with_library: bool) -> None:
    """Print, for each arm, what is in use and the largest block in each stage."""
    for joints, rate in ARMS:
        arm = arm_record([rate] * joints)
        session = Session()
        session.command("hello", (wire.PROTOCOL_VERSION, 1))
        motion = motion_record(arm, 40)
        session.run(arm, motion)
        again = Session()
        again.command("hello", (wire.PROTOCOL_VERSION, 1))
        again.start(arm, motion)
        print(f"{joints} x {rate:>6}: needs {engine_memory.needed_bytes([rate] * joints):>5}")
        for outcome in drive(elf, with_library, session, again):
            cells = "  ".join(f"{name} {used} / {free}" for name, used, free in outcome.stages)
            print(f"    {cells}; {outcome.refusals}; sectors erased {outcome.erasures}", flush=True)


def blocks(with_library: bool) -> None:
    """Print the blocks of the flash that are in use in addition to MicroPython's own after each stage.

    The start files take the blocks of MicroPython's.
    """
    started = [len(data) for data in program_files.start_files().values()]
    assert max(started) <= _BLOCK
    files = program_files.library(STM32F4) if with_library else {}
    folders = 1 + with_library
    sizes = {"deployed": [len(data) for data in files.values()], "the largest motion": [MAX_MOTION_BYTES]}
    sizes["an arm"] = [len(arm_record([25_000] * 3))]
    found = {stage: sum(-(-size // _BLOCK) for size in each) for stage, each in sizes.items()}
    found["deployed"] += folders
    print("blocks of the flash: " + ", ".join(f"{stage} {count}" for stage, count in found.items()))


def changes(elf: Path, with_library: bool, count: int, seed: int = 12) -> None:
    """Print what is left after that many random arms."""
    rng = random.Random(seed)
    session = Session(rounds=-(-count // _MOST_ARMS))
    session.command("hello", (wire.PROTOCOL_VERSION, 1))
    arms = -(-count // session.rounds)
    for number in range(arms):
        arm = arm_record([rng.randrange(1_000, 240_001) for _ in range(rng.randrange(1, 7))])
        if number % (arms - 1) == 0:
            arm = arm_record([20_000] * 3)
        session.run(arm, motion_record(arm, rng.randrange(5, 16)))
        session.command("remove", (), b"go")
        session.stage("changed")
    (outcome,) = drive(elf, with_library, session, limit_s=3600.0)
    told = [(used, free) for name, used, free in outcome.stages if name == "changed"]
    memory = sum(code in ("no_memory", "failed") for _, code, _ in outcome.refusals)
    for number, code, _ in outcome.refusals:
        if code in ("no_memory", "failed"):
            place = 1 + (number - 1) % (len(session.sent) - 1) if number else 0
            print(f"command {number}, {session.sent[place]}: {code}")
    print(f"seed {seed}: {len(told)} arms; first {told[0]}, last {told[-1]}; out of memory {memory} times")


def main(micropython: Path, count: int) -> None:
    """Print the figures."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        frozen.write(folder / "program", "$(BOARD_DIR)/manifest.py")
        for title, manifest in (("files", None), ("in the firmware", folder / "program" / "manifest.py")):
            elf = build(micropython, folder, manifest)
            print(f"{title}: in use / largest free block, bytes")
            table(elf, manifest is None)
            blocks(manifest is None)
            if count > 1:
                changes(elf, manifest is None, count)


if __name__ == "__main__":
    main(Path(sys.argv[1]).resolve(), int(sys.argv[2]) if len(sys.argv) > 2 else 0)
