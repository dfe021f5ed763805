"""The runs of a sequence over the link: every sample of each, on a bad line and after a loss of it, too."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from armtempo.basics.errors import LinkError
from armtempo.encoding import encoded_plan
from armtempo.encoding.encoded_plan import Encoded, EncodedLeg, MotionKey
from armtempo.link import Client
from armtempo.link.board_messages import RowBegun, Sample
from armtempo.link.follow import Followed, SequenceFollower, SequenceWatcher
from armtempo.model.arm import Arm
from armtempo.planning.point_to_point import straight
from armtempo.report.run import Run
from armtempo.report.run_folder import Repetition
from armtempo.robot import recording, running
from armtempo.robot.recording import Watcher
from armtempo.robot.stop_request import StopRequest
from armtempo.robot.store import store
from armtempo_shared import sequence, wire

from tests.inprocess import ARM, Noise, Pipe, ready


def sequence_of(pipe: Pipe, times: int) -> tuple[Client, MotionKey]:
    """A board with a sequence that runs ``feed`` so many times without a pause."""
    board, data = ready(pipe)
    board.home([7, 7, 7])
    ends: Any = pipe._later["armtempo_board.motion.endpoints"]
    ends.at_end = ends.at_start  # the next motion begins there
    rows = [(sequence.REPEAT, 0, 0, times, 1), (sequence.MOVE, 0, 0, 0, 2), (sequence.END, 0, 1, 0, 3)]
    record = sequence.pack(wire.record_crc(ARM), rows, [("feed", wire.record_crc(data))])
    board.upload("again", record)
    return board, MotionKey("again", wire.record_crc(record))


def run(
    board: Client,
    key: MotionKey,
    take: Callable[[Followed], object],
    on_state: SequenceWatcher = lambda _: None,
) -> SequenceFollower:
    """Run a sequence to its end."""
    wanted = StopRequest()
    with running.attended(board, wanted):
        follower = SequenceFollower(board, key.name, board.start(key.name, key.crc), on_state)
        return running.follow(board, wanted, follower, take)


def sequence_samples(
    board: Client, key: MotionKey, at_7: Callable[[], None] = lambda: None
) -> SequenceFollower:
    """Run it; each sample arrives once, those of each motion numbered from 0. ``at_7``: called with sample 7."""
    found: list[tuple[int, int]] = []

    def take(event: Followed) -> None:
        if isinstance(event, Sample):
            found.append((event.run, event.index))
            if len(found) == 8:
                at_7()

    followed = run(board, key, take)
    assert followed.end.ending == "finished"
    assert found == [(run, index) for run in range(1, followed.end.cycle + 1) for index in range(4)]
    return followed


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_a_sequence_gives_every_sample_of_every_motion(tmp_path: Path, noise: float) -> None:
    """Also the last one of a motion that the next one follows at once; on a line that damages bytes, too (seed 3)."""
    pipe = Pipe(tmp_path / "flash")
    pipe.run_samples = 4
    board, key = sequence_of(pipe, 12)
    pipe.disturb(Noise("to 3", noise), Noise("from 3", noise))
    assert sequence_samples(board, key).lost == ()


class Counting(Watcher):
    """Counts what it is told."""

    def __init__(self) -> None:
        self.samples: list[tuple[int, float]] = []
        self.ended: list[str] = []

    def on_sample(self, sample: Sample, duration_s: float) -> None:
        self.samples.append((sample.index, duration_s))

    def end(self, repetition: Repetition) -> None:
        self.ended.append(repetition.state)


def test_a_watcher_sees_a_sequence_as_a_motion(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    pipe.run_samples = 4
    board, key = sequence_of(pipe, 2)
    arm = Arm.paper()
    leg = EncodedLeg("feed", straight("feed", [0.0] * 3, [1.0] * 3, arm), board.fetch("feed"))
    rows = encoded_plan.described(sequence.SequenceData(board.fetch(key.name)), arm)
    encoded = Encoded(key.name, arm, (leg,), rows, board.fetch(key.name))
    folder = recording.new_run(tmp_path / "runs", encoded, "pipe", board)
    seen, states = Counting(), list[str]()
    with recording.repetition(board, encoded, folder, seen) as recorder:
        followed = run(board, key, recorder.take, lambda state: states.append(state.ending))
        recorder.end(followed.end, followed.lost, stopped=False)
    assert seen.samples == [(index, leg.trajectory.duration_s) for index in range(4)] * 2
    assert seen.ended == states[-1:] == ["finished"]
    assert [row.passed for row in Run.load(folder.path).rows] == [1, 2, 3, 4, 5]


def test_a_sequence_whose_cable_was_out_lacks_no_sample(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    pipe.run_samples = 4
    board, key = sequence_of(pipe, 6)
    assert sequence_samples(board, key, lambda: pipe.unplug_for(1.5)).lost == ()
    assert [text.split()[0] for text in pipe.told] == ["the", "connected"]


def test_nothing_of_a_run_that_nobody_followed_is_taken_for_the_next_ones(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    pipe.run_samples = 4
    board, key = sequence_of(pipe, 2)
    board.start(key.name, key.crc)
    while board.sequence().ending == "running":
        pipe.wait(0.1)
    board.home([7, 7, 7])
    passed: list[int] = []
    run(board, key, lambda event: isinstance(event, RowBegun) and passed.append(event.passed))
    assert passed == [1, 2, 3, 4, 5]


def test_the_samples_of_a_sequence_are_not_fetched_as_a_motions(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    pipe.run_samples = 4
    board, key = sequence_of(pipe, 2)
    board.start(key.name, key.crc)
    pipe.wait(0.1)
    while board.status().moving:
        pipe.wait(0.1)
    nothing: Any = None
    with pytest.raises(LinkError, match="that of a sequence"):
        recording.fetch(board, nothing, tmp_path / "runs", "pipe")
    assert not (tmp_path / "runs").exists()


def test_what_replaces_a_sequence_takes_its_motions_along(tmp_path: Path) -> None:
    board, data = ready(Pipe(tmp_path / "flash"))
    record = sequence.pack(
        wire.record_crc(ARM), [(sequence.MOVE, 0, 0, 0, 1)], [("s-1", wire.record_crc(data))]
    )
    counted: list[tuple[float, float]] = []
    key = store(board, [("s-1", data), ("s", record)], lambda *at: counted.append(at))
    whole = len(data) + len(record)
    assert key == MotionKey("s", wire.record_crc(record))
    assert counted == sorted(counted)
    assert counted[-1] == (whole, whole)
    with pytest.raises(
        LinkError, match=rf"the board has another sequence 's' \(checksum {key.crc:08x}\)"
    ) as caught:
        store(board, [("s", data)])
    assert "--force" in caught.value.hint
    store(board, [("s", data)], replace=True)
    assert [(entry.name, entry.sequence) for entry in board.stored()] == [("feed", False), ("s", False)]
