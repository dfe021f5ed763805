"""When a port breaks or falls silent: whom the host finds there again, what it says, when it stops waiting."""

from __future__ import annotations

import random
from collections.abc import Callable
from pathlib import Path

import pytest
from armtempo import operate
from armtempo.errors import LinkError
from armtempo.interrupt import StopRequest
from armtempo.link import Board
from armtempo.link.follow import RunEnd
from armtempo.link.messages import Sample
from armtempo.link.session import OtherBoard
from armtempo_shared import armrecord, motion, wire

from tests.board.scripts import stand_in
from tests.inprocess import Pipe, connect

ARM = stand_in.arm(3)


def ready(pipe: Pipe) -> tuple[Board, operate.Stored]:
    """A board with known positions and a motion."""
    board = connect(pipe)
    board.upload(wire.ARM_RECORD_NAME, ARM)
    numbers = random.Random(5)
    points = [[numbers.randrange(2**40) for _ in range(11)] for _ in range(3)]
    data = motion.pack(5, points, points, 6, 1, 0, armrecord.unpack(ARM)[2])
    board.upload("feed", data)
    board.home([0, 0, 0])
    return board, operate.Stored("feed", wire.record_crc(data))


def replay(
    board: Board, stored: operate.Stored, at_20: Callable[[], None], stop: StopRequest | None = None
) -> tuple[RunEnd, list[int]]:
    """Run it; ``at_20`` is called with the sample number 20."""
    indices: list[int] = []

    def take(sample: Sample, duration_s: float) -> None:
        indices.append(sample.index)
        if sample.index == 20:
            at_20()

    return operate.replay(board, stored, stop or StopRequest(), take), indices


@pytest.mark.parametrize("trouble", ["unplug_for", "silence_for"])
def test_trouble_is_told_once_and_its_end_once(tmp_path: Path, trouble: str) -> None:
    pipe = Pipe(tmp_path / "flash")
    board, stored = ready(pipe)
    told: list[str] = []
    board.session.tell = told.append
    end, indices = replay(board, stored, lambda: getattr(pipe, trouble)(9.0))
    assert [text.rsplit(" ", 1)[1] for text in told] == ["back", "again"]
    assert indices == list(range(pipe.run_samples))
    assert end.samples_lost == 0


def test_a_board_that_stays_silent_is_given_up_after_a_minute(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    board, stored = ready(pipe)
    told: list[str] = []
    board.session.tell = told.append
    begin_s = pipe.clock()
    with pytest.raises(LinkError, match="did not answer"):
        replay(board, stored, lambda: pipe.silence_for(1e6))
    assert len(told) == 1
    assert 60 < pipe.clock() - begin_s < 80


def test_another_board_at_the_same_port_gets_no_command(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    board, stored = ready(pipe)

    def swap() -> None:
        pipe.unplug_for(1.0)
        pipe.swap_board(b"another")
        pipe.app.engine.moving = True

    with pytest.raises(LinkError, match=r"another board is on pipe now \(another, before") as caught:
        replay(board, stored, swap)
    assert "after the last sample" in str(caught.value)
    assert pipe.app.engine.calls == []  # above all no stop


def test_the_same_board_started_anew_is_found_out_before_any_command(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    board, _ = ready(pipe)
    pipe.unplug_for(1.0)
    pipe.swap_board(pipe.app.board_id)
    with pytest.raises(OtherBoard, match="started anew"):
        board.home([1, 2, 3])
    assert "home" not in pipe.app.engine.calls
    assert board.session.reopen is not None


def test_a_command_under_way_is_answered_after_the_greeting(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    board, _ = ready(pipe)
    pipe.unplug_for(1.0)
    assert board.find("feed") is not None


@pytest.mark.parametrize("trouble", ["unplug_for", "silence_for"])
def test_a_wanted_stop_shortens_the_waiting(tmp_path: Path, trouble: str) -> None:
    pipe = Pipe(tmp_path / "flash")
    board, stored = ready(pipe)
    stop = StopRequest()

    def interrupt() -> None:
        getattr(pipe, trouble)(1e6)
        stop.wanted = True

    begin_s = pipe.clock()
    words = {"unplug_for": "could not be told to stop", "silence_for": "told to stop and does not"}
    with pytest.raises(LinkError, match=words[trouble]):
        replay(board, stored, interrupt, stop)
    assert pipe.clock() - begin_s < 20.0
