"""A board in the same process that is ready to move, and a run of it."""

from __future__ import annotations

import random

from armtempo.link import Client
from armtempo.link.board_messages import Sample
from armtempo.link.follow import Follower, RunEnd
from armtempo_shared import motion, wire

from tests.board.scripts.rigs import stand_in
from tests.inprocess import Pipe, connect

ARM = stand_in.arm(3)


def random_motion(numbers: random.Random, segments: int = 6, joints: int = 3) -> bytes:
    """A motion record for ``ARM``; its numbers mean nothing."""
    points = [[numbers.randrange(2**40) for _ in range(segments + 5)] for _ in range(joints)]
    return motion.pack(5, points, points, 1, motion.NO_RAMPS, wire.record_crc(ARM))


def ready(pipe: Pipe) -> tuple[Client, bytes]:
    """A board with arm, motion ``feed`` and known positions."""
    board = connect(pipe)
    board.upload(wire.ARM_RECORD_NAME, ARM)
    data = random_motion(random.Random(5))
    board.upload("feed", data)
    board.home([0, 0, 0])
    return board, data


def started(pipe: Pipe) -> Follower:
    """A run of ``feed`` that has just begun on a board made ready for it."""
    board, data = ready(pipe)
    run = board.start("feed", wire.record_crc(data)).run
    return Follower(board, run)


def follow(follower: Follower) -> tuple[list[Sample], RunEnd]:
    """All samples of the run, and how it ended."""
    samples = list(follower.samples())
    assert follower.ended
    return samples, follower.end
