"""Figures of the link: ``python -m tests.benchmark.link`` prints all of them.

Bytes, round trips and time per upload over lines of different quality, what a run loses under each kind of
fault, the longest pause that costs no sample: the board's own link and store in this process, time simulated
(a flash that writes at once, USB without delay). Upload to ready: on a virtual board in real time, whose flash
is as slow as the chip's. Frames fuzzed and power cuts: the counts of the tests that do it, done again.
"""

from __future__ import annotations

import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from armtempo.basics.errors import LinkError
from armtempo.link import Client, open_board
from armtempo.link.follow import Follower
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.planning import planner
from armtempo.records import encoded_motion
from armtempo.robot import arm_state
from armtempo.simulator import launch
from armtempo_shared import armrecord, motion, wire

from tests import interpreters
from tests.board.scripts.rigs import stand_in
from tests.inprocess import FAULTS, Noise, Pipe, connect

ARM = stand_in.arm(3)
UPLOADS = 50
RUNS = 10
FUZZED_FRAMES = 100_000
FUZZ_SEED = 20261121
CASES = interpreters.ROOT / "tests" / "board" / "scripts" / "cases"


def motion_record(numbers: random.Random, arm: bytes = ARM, segments: int = 6) -> bytes:
    """A record of the shipped job's size: three joints, six segments, quintic."""
    _, joints, crc = armrecord.unpack(arm)
    points = [[numbers.randrange(2**40) for _ in range(segments + 5)] for _ in joints]
    return motion.pack(5, points, points, 1, 0, crc)


def ready(pipe: Pipe, arm: bytes = ARM) -> tuple[Client, int]:
    """A board with arm, motion ``feed`` and known positions, and that motion's checksum."""
    board = connect(pipe)
    board.upload(wire.ARM_RECORD_NAME, arm)
    data = motion_record(random.Random(1), arm)
    board.upload("feed", data)
    board.home([0] * len(armrecord.unpack(arm)[1]))
    return board, wire.record_crc(data)


def uploads(folder: Path, rate: float, kinds: tuple[str, ...]) -> str:
    """One line of the first table."""
    pipe = Pipe(folder, Noise("to", rate, kinds), Noise("from", rate, kinds))
    board = connect(pipe)
    board.upload(wire.ARM_RECORD_NAME, ARM)
    numbers = random.Random(1)
    pipe.round_trips = pipe.bytes_sent = 0
    begin_s = pipe.clock()
    for _ in range(UPLOADS):
        board.upload("feed", motion_record(numbers))
    seconds = (pipe.clock() - begin_s) / UPLOADS
    return f"{pipe.bytes_sent / UPLOADS:8.0f}{pipe.round_trips / UPLOADS:14.1f}{seconds:10.2f}"


def upload_to_ready_s() -> tuple[float, float]:
    """Seconds from the first byte of an upload until its motion may be started, and of the whole command."""
    arm = Arm.paper()
    plan = planner.plan(arm, Job.paper(arm))
    with tempfile.TemporaryDirectory() as name, launch() as process:
        file = Path(name) / "feed.json"
        plan.save(file)
        with open_board(process.port) as board:
            arm_state.configure(board, arm, replace=True)
            begin_s = time.monotonic()
            board.upload("first", encoded_motion.of_plan(plan).data)
            upload_s = time.monotonic() - begin_s
        begin_s = time.monotonic()
        words = ["-c", "from armtempo.cli import main; main()", "upload", str(file), "--port", process.port]
        subprocess.run([sys.executable, *words], check=True, capture_output=True)
        return upload_s, time.monotonic() - begin_s


def runs(rate: float, kind: str) -> str:
    """One line of the second table: samples that arrived, samples known to be lost, runs given up."""
    arrived = lost = given_up = 0
    for number in range(RUNS):
        with tempfile.TemporaryDirectory() as name:
            pipe = Pipe(Path(name) / "flash")
            board, crc = ready(pipe)
            run = board.start("feed", crc).run
            follower = Follower(board, run)
            pipe.disturb(Noise(f"to {number}", rate, (kind,)), Noise(f"from {number}", rate, (kind,)))
            try:
                for _ in follower.samples():
                    arrived += 1
            except LinkError:
                given_up += 1
            lost += follower.end.samples_lost if follower.ended else 0
    return f"{arrived:8}{lost:8}{given_up:10}"


def survives(pause_s: float, arm: bytes) -> bool:
    """Whether a host that reads nothing for so long, from the start of a motion, gets every sample."""
    with tempfile.TemporaryDirectory() as name:
        pipe = Pipe(Path(name) / "flash")
        pipe.run_samples = 700
        board, crc = ready(pipe, arm)
        run = board.start("feed", crc).run
        follower = Follower(board, run)
        pipe.wait_away(pause_s)
        return len(list(follower.samples())) == pipe.run_samples


def longest_pause_s(arm: bytes) -> float:
    """The longest time without a host that costs no sample, to 0.1 s."""
    low, high = 0, 600  # tenths of a second: the first is survived, the last is not
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if survives(middle / 10, arm) else (low, middle)
    return low / 10


def power_cuts() -> tuple[int, int]:
    """How often the power was cut, and how often the flash failed or was full, at every change of the store."""
    lines = interpreters.run(interpreters.AVAILABLE[-1], CASES / "store_cuts.py").splitlines()
    counts = {"cut": 0, "error": 0, "full": 0}
    for words in map(str.split, lines):
        if words[0] in counts:
            counts[words[0]] += len(words[-1]) - 1  # the last came when all was done
    return counts.pop("cut"), sum(counts.values())


def main() -> None:
    """Print all tables."""
    size = len(motion_record(random.Random(1)))
    print(f"upload of {size} bytes      bytes   round trips   seconds")
    for rate in (0.0, 0.001, 0.01, 0.02):
        with tempfile.TemporaryDirectory() as name:
            print(f"all faults, {100 * rate:4.1f} %    {uploads(Path(name) / 'flash', rate, FAULTS)}")
    upload_s, command_s = upload_to_ready_s()
    print(f"\nupload to ready on a virtual board: {upload_s:.2f} s; the whole command {command_s:.1f} s")
    print(f"\n{RUNS} runs of 70 samples   arrived    lost  given up")
    for rate in (0.01, 0.05):
        for kind in FAULTS:
            print(f"{kind:<8} {100 * rate:3.1f} %        {runs(rate, kind)}")
    print("\nlongest pause of the host without a lost sample")
    for joints in (1, 3, 6):
        print(f"{joints} joints    {longest_pause_s(stand_in.arm(joints)):5.1f} s")
    print("\nframes fuzzed      given     acted on")
    for name in interpreters.AVAILABLE:
        words = str(FUZZED_FRAMES), str(FUZZ_SEED)
        given, acted = interpreters.run(name, CASES / "fuzz.py", *words).split()[:2]
        print(f"{name:<16}{given:>8}{acted:>13}")
    cuts, failures = power_cuts()
    print(f"\npower cuts, one at each change of each operation of the store: {cuts}")
    print(f"failing or full flash, the same: {failures}")


if __name__ == "__main__":
    main()
