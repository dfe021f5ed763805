"""If a port breaks, falls silent or is closed: which board is accepted again, messages, time limits."""

from __future__ import annotations

import os
import random
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from threading import Event, Thread

import pytest
from armtempo.basics.errors import LinkError, NoAnswerError, OtherBoardError
from armtempo.encoding.encoded_plan import MotionKey
from armtempo.link import Client
from armtempo.link.board_messages import Sample
from armtempo.link.follow import MotionFollower, RunEnd
from armtempo.link.transport import SerialTransport
from armtempo.robot.board import Board
from armtempo.robot.stop_request import StopRequest
from armtempo_shared import wire

from tests import inprocess
from tests.inprocess import Pipe, connect, random_motion, ready


def prepared(pipe: Pipe) -> tuple[Client, MotionKey]:
    """A board with known positions and a motion."""
    board, data = ready(pipe)
    return board, MotionKey("feed", wire.record_crc(data))


def replay(
    board: Client, stored: MotionKey, at_20: Callable[[], None], stop: StopRequest | None = None
) -> tuple[RunEnd, list[int]]:
    """Run it; ``at_20`` is called with the sample number 20."""
    indices: list[int] = []

    def take(sample: Sample) -> None:
        indices.append(sample.index)
        if sample.index == 20:
            at_20()

    return inprocess.replay(board, stored, stop or StopRequest(), take), indices


@pytest.mark.slow
@pytest.mark.parametrize("trouble", ["unplug_for", "silence_for"])
def test_trouble_is_told_once_and_its_end_once(tmp_path: Path, trouble: str) -> None:
    pipe = Pipe(tmp_path / "flash")
    board, stored = prepared(pipe)
    end, indices = replay(board, stored, lambda: getattr(pipe, trouble)(9.0))
    assert [text.rsplit(" ", 1)[1] for text in pipe.told] == ["back", "again"]
    assert indices == list(range(pipe.run_samples))
    assert end.samples_lost == 0


@pytest.mark.slow
def test_a_board_that_stays_silent_is_given_up_after_a_minute(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    board, stored = prepared(pipe)
    begin_s = pipe.clock()
    with pytest.raises(LinkError, match="did not answer"):
        replay(board, stored, lambda: pipe.silence_for(1e6))
    assert len(pipe.told) == 1
    assert 60 < pipe.clock() - begin_s < 80


@pytest.mark.slow
def test_another_board_at_the_same_port_gets_no_command(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    board, stored = prepared(pipe)

    def swap() -> None:
        pipe.unplug_for(1.0)
        pipe.swap_board(b"another")
        pipe.app.controller.board.engine.moving = True

    with pytest.raises(LinkError, match=r"another board is on pipe now \(another, before") as caught:
        replay(board, stored, swap)
    assert "the last sample" in str(caught.value)
    assert pipe.app.controller.board.engine.calls == []  # above all no stop


@pytest.mark.slow
def test_the_same_board_started_anew_is_found_out_before_any_command(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    board, _ = prepared(pipe)
    pipe.unplug_for(1.0)
    pipe.swap_board(pipe.app.controller.board.board_id)
    with pytest.raises(OtherBoardError, match="restarted"):
        board.home([1, 2, 3])
    assert "home" not in pipe.app.controller.board.engine.calls


def test_a_command_under_way_is_answered_after_the_greeting(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    board, _ = prepared(pipe)
    pipe.unplug_for(1.0)
    assert board.find("feed") is not None


@pytest.mark.slow
@pytest.mark.parametrize("trouble", ["unplug_for", "silence_for"])
def test_a_wanted_stop_shortens_the_waiting(tmp_path: Path, trouble: str) -> None:
    pipe = Pipe(tmp_path / "flash")
    board, stored = prepared(pipe)
    stop = StopRequest()

    def interrupt() -> None:
        getattr(pipe, trouble)(1e6)
        stop.wanted = True

    begin_s = pipe.clock()
    words = {"unplug_for": "no stop could be sent", "silence_for": "told to stop but still moves"}
    with pytest.raises(LinkError, match=words[trouble]):
        replay(board, stored, interrupt, stop)
    assert pipe.clock() - begin_s < 20.0


@pytest.mark.slow
def test_cable_out_during_a_run_costs_no_sample(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    board, data = ready(pipe)
    run = board.start("feed", wire.record_crc(data))
    indices = []
    follower = MotionFollower(board, run)
    for sample in follower.samples():
        indices.append(sample.index)
        if sample.index in (20, 40):
            pipe.unplug_for(1.5)
    assert indices == list(range(pipe.run_samples))
    assert [text.split()[0] for text in pipe.told] == ["the", "connected"] * 2


def test_a_sample_comes_once_though_the_board_was_silent_to_whoever_took_it(tmp_path: Path) -> None:
    """Such as a watcher that changes the speed."""
    pipe = Pipe(tmp_path / "flash")
    pipe.run_samples = 30
    board, stored = prepared(pipe)
    silent = [NoAnswerError("the board is silent")]

    def speed() -> None:
        if silent:
            raise silent.pop()

    end, indices = replay(board, stored, speed)
    assert indices == list(range(pipe.run_samples))
    assert end.received == pipe.run_samples


@pytest.mark.slow
def test_cable_out_during_an_upload(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    board, _ = ready(pipe)
    data = random_motion(random.Random(7), segments=60)
    board.upload("feed", data, lambda done, whole: pipe.unplug_for(0.7))
    assert board.fetch("feed") == data


def test_cable_that_stays_out(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    board, _ = ready(pipe)
    pipe.unplug_for(1000.0)
    begin_s = pipe.clock()
    with pytest.raises(LinkError, match="unplugged"):
        board.status()
    assert 50 < pipe.clock() - begin_s < 70


@pytest.mark.slow
def test_board_that_started_anew_is_found_out(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    with pytest.raises(LinkError, match="restarted during the motion"):
        replay(*prepared(pipe), pipe.start_board)


def test_silent_board_is_reported_in_time(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    board = connect(pipe)
    pipe._send = lambda way, frame: None  # type: ignore[method-assign]
    begin_s = pipe.clock()
    with pytest.raises(NoAnswerError, match="did not answer 'status'"):
        board.status()
    assert pipe.clock() - begin_s < 4.0


@pytest.mark.slow
def test_a_cable_that_is_out_does_not_keep_who_wants_an_end(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    stop = StopRequest()
    ended_s = [0.0]

    def unplug() -> None:
        pipe.unplug_for(1000.0)
        stop.wanted = True
        ended_s[0] = pipe.clock()

    with pytest.raises(LinkError, match="no stop could be sent"):
        replay(*prepared(pipe), unplug, stop)
    assert pipe.clock() - ended_s[0] < 10.0


def test_a_board_is_closed_between_the_commands_of_other_threads(tmp_path: Path) -> None:
    client = connect(Pipe(tmp_path / "flash"))
    closed = Event()
    stack = ExitStack()
    stack.callback(closed.set)
    board = Board(client, "pipe", stack)
    with client.session.lock:
        closing = Thread(target=board.close)
        closing.start()
        assert not closed.wait(0.05)
        client.hello()
    closing.join()
    assert closed.is_set()
    with pytest.raises(LinkError, match="the board on pipe was closed"):
        client.hello()


def test_who_waits_for_a_cable_does_not_open_a_port_that_was_closed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("armtempo.robot.board.LOCK_S", 0.01)
    pipe = Pipe(tmp_path / "flash")
    client = connect(pipe)
    with client.session.lock:
        closing = Thread(target=Board(client, "pipe").close)
        closing.start()
        closing.join()
        with pytest.raises(LinkError, match="the board on pipe was closed"):
            client.session.reconnect(LinkError("the cable is out"))


def test_a_port_that_was_closed_meanwhile_is_a_broken_one() -> None:
    host, device = os.openpty()
    port = SerialTransport(os.ttyname(device), exclusive=False)
    port.close()
    port._serial.is_open = True  # as another thread sees it that is just within a call
    with pytest.raises(LinkError, match="broke"):
        port.write(b"x")
    with pytest.raises(LinkError, match="broke"):
        port.read(0.0)
    os.close(host)
    os.close(device)


def test_an_error_of_the_caller_leaves_the_link_as_it_was(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    board, stored = prepared(pipe)
    with pytest.raises(ZeroDivisionError):
        replay(board, stored, lambda: print(1 // 0))
    assert pipe.app.controller.board.engine.calls[-1] == "freeze"  # a motion without brake times
    pipe.unplug_for(20.0)
    assert board.status().moving is False
    assert [text.split()[0] for text in pipe.told] == ["the", "connected"]


def test_after_a_stopped_run_a_cable_is_waited_for_as_ever(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    board, stored = prepared(pipe)
    stop = StopRequest()
    replay(board, stored, lambda: stop.ask("a test"), stop)
    pipe.unplug_for(20.0)
    assert board.status().moving is False
    assert len(pipe.told) == 2
    stop.ask("later")  # wakes nobody


@pytest.mark.slow
def test_a_cable_that_is_out_for_long_ends_the_call_but_not_the_link(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    board, stored = prepared(pipe)
    with pytest.raises(LinkError, match="unplugged"):
        replay(board, stored, lambda: pipe.unplug_for(90.0))
    assert board.status().run
    assert pipe.told[-1] == "connected to pipe again"
