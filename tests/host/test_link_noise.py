"""A line that damages bytes: what arrives is right, or the host says why not."""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from armtempo.basics.errors import LinkError
from armtempo.link.follow import Follower
from armtempo_shared import wire

from tests.host.linked import ARM, follow, random_motion, ready, started
from tests.inprocess import FAULTS, Noise, Pipe, connect


@pytest.mark.slow
def test_three_hundred_uploads_over_a_bad_line_arrive_identical(tmp_path: Path) -> None:
    to_board, from_board = Noise("to", 0.01), Noise("from", 0.01)
    pipe = Pipe(tmp_path / "flash", to_board, from_board)
    board = connect(pipe)
    numbers = random.Random(1)
    board.upload(wire.ARM_RECORD_NAME, ARM)
    for number in range(300):
        data = random_motion(numbers, segments=numbers.randrange(1, 4), joints=1)
        board.upload("feed", data)
        assert (tmp_path / "flash" / "feed.atm").read_bytes() == data, f"upload {number}"
    assert to_board.hits > 600
    assert from_board.hits > 90


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(8))
def test_runs_over_a_bad_line_are_complete(tmp_path: Path, seed: int) -> None:
    pipe = Pipe(tmp_path / "flash", Noise(f"to {seed}", 0.01), Noise(f"from {seed}", 0.01))
    samples, end = follow(started(pipe))
    assert [sample.index for sample in samples] == list(range(pipe.run_samples))
    assert (end.fault, end.lost) == (0, ())


@pytest.mark.slow
@pytest.mark.parametrize("kind", FAULTS)
def test_five_percent_is_survived_or_said(tmp_path: Path, kind: str) -> None:
    pipe = Pipe(tmp_path / "flash")
    board, old = ready(pipe)
    run = board.start("feed", wire.record_crc(old)).run
    pipe.disturb(Noise(f"to {kind}", 0.05, (kind,)), Noise(f"from {kind}", 0.05, (kind,)))
    follower = Follower(board, run)
    indices: list[int] = []
    new = random_motion(random.Random(6))
    said = ""
    try:
        for sample in follower.samples():
            assert sample.positions.commanded_steps == (sample.index,) * 3
            indices.append(sample.index)
        assert follower.ended
        missing = [index for first, count in follower.end.lost for index in range(first, first + count)]
        assert sorted(indices + missing) == list(range(pipe.run_samples))
        board.upload("feed", new)
    except LinkError as error:
        said = str(error)
    assert not said or "messages arrived damaged (" in said
    assert indices == sorted(set(indices))
    assert (tmp_path / "flash" / "feed.atm").read_bytes() in (old, new)
