"""Figures of the link: ``python -m tests.benchmark.link``.

Bytes, round trips and time per upload over lines of different quality, and what a run loses; the board's own
link and store in this process, its time simulated (a flash that writes at once, USB without delay).
"""

from __future__ import annotations

import random
import tempfile
from pathlib import Path

from armtempo.link.follow import Follower
from armtempo_shared import armrecord, motion, wire

from tests.board.scripts import stand_in
from tests.inprocess import FAULTS, Noise, Pipe, connect

ARM = stand_in.arm(3)
UPLOADS = 50
RUNS = 10


def motion_record(numbers: random.Random, segments: int = 6) -> bytes:
    """A record of the shipped job's size: three joints, six segments, quintic."""
    points = [[numbers.randrange(2**40) for _ in range(segments + 5)] for _ in range(3)]
    return motion.pack(5, points, points, segments, 1, 0, armrecord.unpack(ARM)[2])


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


def runs(folder: Path, rate: float, kinds: tuple[str, ...]) -> str:
    """One line of the second table: samples taken and samples lost in RUNS runs."""
    pipe = Pipe(folder, Noise("to", rate, kinds), Noise("from", rate, kinds))
    board = connect(pipe)
    board.upload(wire.ARM_RECORD_NAME, ARM)
    data = motion_record(random.Random(1))
    board.upload("feed", data)
    board.home([0, 0, 0])
    received = lost = 0
    for _ in range(RUNS):
        run, _ = board.start("feed", wire.record_crc(data))
        follower = Follower(board, run)
        received += len(list(follower.samples()))
        lost += follower.end.samples_lost if follower.end else 0
    return f"{received:8}{lost:8}"


def longest_pause_s() -> float:
    """The longest time without a host that costs no sample, three joints."""
    for pause_s in range(60, 0, -1):
        with tempfile.TemporaryDirectory() as name:
            pipe = Pipe(Path(name) / "flash")
            pipe.run_samples = 700
            board = connect(pipe)
            board.upload(wire.ARM_RECORD_NAME, ARM)
            data = motion_record(random.Random(1))
            board.upload("feed", data)
            board.home([0, 0, 0])
            run, _ = board.start("feed", wire.record_crc(data))
            pipe.wait_away(pause_s)
            follower = Follower(board, run)
            if len(list(follower.samples())) == pipe.run_samples:
                return pause_s
    return 0.0


def main() -> None:
    """Print all tables."""
    size = len(motion_record(random.Random(1)))
    print(f"upload of {size} bytes      bytes   round trips   seconds")
    for rate in (0.0, 0.001, 0.01, 0.02):
        with tempfile.TemporaryDirectory() as name:
            print(f"all faults, {100 * rate:4.1f} %    {uploads(Path(name) / 'flash', rate, FAULTS)}")
    print("\nruns of 70 samples    samples    lost")
    for kind in FAULTS:
        with tempfile.TemporaryDirectory() as name:
            print(f"{kind:<8} 1.0 %        {runs(Path(name) / 'flash', 0.01, (kind,))}")
    print(f"\nlongest pause of the host without a lost sample: {longest_pause_s():.0f} s")


if __name__ == "__main__":
    main()
