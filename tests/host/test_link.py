"""Commands, runs and their samples over a good line and over one that damages bytes."""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from armtempo.basics.errors import BoardError, LinkError
from armtempo.encoding.encoded_plan import MotionKey
from armtempo.link import Client
from armtempo.link.client import harmless_number
from armtempo.link.follow import MotionFollower
from armtempo.link.session import Session
from armtempo.robot import running
from armtempo.robot.stop_request import StopRequest
from armtempo_shared import wire
from armtempo_shared.messages import START_SWITCHES_BIT

from tests.inprocess import ARM, FAULTS, Noise, Pipe, connect, follow, random_motion, ready, replay, started


@pytest.mark.slow
def test_store_commands(tmp_path: Path) -> None:
    board, data = ready(Pipe(tmp_path / "flash"))
    assert board.fetch("feed") == data
    assert [entry.name for entry in board.stored()] == ["feed"]
    board.rename("feed", "other")
    board.set_default("other")
    found = board.find("other")
    assert found is not None
    assert (found.default, found.crc, found.size) == (True, wire.record_crc(data), len(data))
    assert board.find("feed") is None
    board.remove("other")
    assert board.stored() == []
    with pytest.raises(BoardError, match="no trajectory of this name") as caught:
        board.remove("other")
    assert caught.value.code == wire.ERROR_CODES["not_found"]


class Listed:
    """A session with a board that has motions of these names."""

    def __init__(self, *names: str) -> None:
        self.names = sorted(names)
        self.asked = 0

    def command(self, command: str, values: tuple[int, ...]) -> tuple[tuple[int, ...], str]:
        self.asked += 1
        if values[0] >= len(self.names):
            raise BoardError("no", "", wire.ERROR_CODES["not_found"])
        return (len(self.names), 1, values[0], 0, 3, 0, 0), self.names[values[0]]


@pytest.mark.parametrize("count", [0, 1, 2, 3, 128])
def test_a_stored_motion_is_found_by_halving(count: int) -> None:
    """As the board reads its folder for each question."""
    names = [f"m{number:03}" for number in range(0, 2 * count, 2)]
    for number in range(-1, 2 * count + 1):
        session = Listed(*names)
        found = Client(session, 1).find(f"m{number:03}")  # type: ignore[arg-type]
        assert (found.name if found else "") == (f"m{number:03}" if f"m{number:03}" in names else "")
        assert session.asked <= 1 + count.bit_length()
    session = Listed(*names)
    assert [entry.name for entry in Client(session, 1).stored()] == names  # type: ignore[arg-type]


def test_run_gives_every_sample_once_in_order(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    samples, end = follow(started(pipe))
    assert [sample.index for sample in samples] == list(range(pipe.run_samples))
    assert (end.fault, end.lost, end.received) == (0, (), pipe.run_samples)
    assert samples[-1].positions == end.positions


def test_between_two_messages_the_caller_has_its_turn(tmp_path: Path) -> None:
    """Also while messages come without a pause."""
    follower = started(Pipe(tmp_path / "flash"))
    turns = 0

    def between() -> None:
        nonlocal turns
        turns += 1

    for number, _ in enumerate(follower.samples(between), 1):
        assert turns >= number


@pytest.mark.slow
def test_repeated_command_acts_once(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    board, data = ready(pipe)
    lost = [True]
    send = pipe._send
    pipe._send = lambda way, frame: None if way == 1 and lost and lost.pop() else send(way, frame)  # type: ignore[method-assign]
    run = board.start("feed", wire.record_crc(data))
    assert board.session.repeats == 1
    assert (run, pipe.app.controller.board.engine.calls.count("start")) == (1, 1)


def test_a_frame_that_never_ends_hides_the_answer_behind_it_for_an_instant_only(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    board, _ = ready(pipe)
    begun = [wire.frame(9, 0x40, bytes(200))[:5]]
    send = pipe._send
    pipe._send = lambda way, frame: send(way, begun.pop() + frame if way == 1 and begun else frame)  # type: ignore[method-assign]
    before_s = pipe.clock()
    board.session.command("status")
    assert not begun
    assert board.session.repeats == 0
    assert pipe.clock() - before_s < 0.2


@pytest.mark.long
@pytest.mark.slow
def test_three_minutes_to_a_host_that_pauses_two_seconds_lose_nothing(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    pipe.run_samples = 1800
    follower = started(pipe)
    indices = []
    for sample in follower.samples():
        indices.append(sample.index)
        if sample.index % 50 == 49:
            pipe.wait_away(2.0)
    assert indices == list(range(1800))


@pytest.mark.slow
def test_gap_is_counted_where_the_board_ran_out_of_memory(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    pipe.run_samples = 500
    board, data = ready(pipe)
    run = board.start("feed", wire.record_crc(data))
    pipe.wait_away(45.0)
    follower = MotionFollower(board, run)
    samples = list(follower.samples())
    assert follower.ended
    missing = set(range(500)) - {sample.index for sample in samples}
    assert missing
    assert {index for first, count in follower.end.lost for index in range(first, first + count)} == missing
    assert follower.end.samples_lost + follower.end.received == 500


@pytest.mark.slow
def test_what_arrived_is_not_lost_though_the_board_has_let_it_go(tmp_path: Path) -> None:
    """The system of a host that is stopped continues reading: then the board keeps only younger samples."""
    pipe = Pipe(tmp_path / "flash")
    pipe.run_samples = 250
    follower = started(pipe)
    pipe.wait_away(17.0, buffer=4096)
    assert [sample.index for sample in follower.samples()] == list(range(250))


@pytest.mark.slow
def test_fault_ends_the_run(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    follower = started(pipe)
    for sample in follower.samples():
        if sample.index == 10:
            engine = pipe.app.controller.board.engine
            engine.fault, engine.fault_joint = wire.ERROR_CODES["following"], 1
            engine.finish()
    assert follower.ended
    assert (follower.end.fault, follower.end.fault_joint) == (wire.ERROR_CODES["following"], 1)


@pytest.mark.slow
def test_homing_motion_starts_anywhere_and_leaves_nothing_known(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    board = connect(pipe)
    board.upload(wire.ARM_RECORD_NAME, ARM)
    data = random_motion(random.Random(5))
    board.upload("feed", data)
    board.home([7, None, None])
    with pytest.raises(BoardError, match="position is unknown"):
        board.start("feed", wire.record_crc(data))
    run = board.start("feed", wire.record_crc(data), wire.START_HOMING)
    assert board.status().known == 7
    samples = list(MotionFollower(board, run).samples())
    assert samples[0].positions.commanded_steps == (7, 7, 7)
    assert board.status().known == 1
    assert pipe.app.controller.board.engine.homing == 0b111
    board.start("feed", wire.record_crc(data), wire.START_HOMING | 0b010 << START_SWITCHES_BIT)
    assert pipe.app.controller.board.engine.homing == 0b010


@pytest.mark.slow
def test_a_motion_that_does_not_end_is_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pipe = Pipe(tmp_path / "flash")
    follower = started(pipe)
    monkeypatch.setattr(pipe, "_move", lambda: None)
    with pytest.raises(LinkError, match="its motion clock does not advance"):
        follow(follower)


@pytest.mark.slow
def test_a_board_that_does_not_stop_is_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pipe = Pipe(tmp_path / "flash")
    board, data = ready(pipe)
    board.start("feed", wire.record_crc(data))
    monkeypatch.setattr(pipe.app.controller.board.engine, "brake", lambda: None)
    monkeypatch.setattr(pipe.app.controller.board.engine, "freeze", lambda: None)
    begin_s = pipe.clock()
    pipe.run_samples = 10_000
    with pytest.raises(LinkError, match="still moves; switch off"):
        running.stop(board, now=False)
    assert pipe.clock() - begin_s < 15.0


def test_what_was_to_stop_before_does_not_start(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    board, data = ready(pipe)
    stop = StopRequest()
    stop.wanted = True
    with pytest.raises(KeyboardInterrupt):
        replay(board, MotionKey("feed", wire.record_crc(data)), stop)
    assert pipe.app.controller.board.engine.calls.count("start") == 0


class Late:
    """A board whose answer to an older command comes just before the one that is asked for."""

    name = "late"

    def __init__(self) -> None:
        self._said = b""

    def write(self, data: bytes) -> None:
        sequence, number = data[3], data[4]
        for delay, value in ((-1, 17), (0, 42)):
            answer = bytes((number,)) + wire.encode(wire.ANSWER["put_data"], [value])
            self._said += wire.frame((sequence + delay) % 256, wire.EVENT["ok"][1], answer)

    def read(self, timeout_s: float) -> bytes:
        said, self._said = self._said, b""
        return said

    def wake(self) -> None: ...

    def close(self) -> None: ...


def test_an_answer_with_another_sequence_number_is_not_taken() -> None:
    session = Session(Late())
    for _ in range(3):
        assert session.command("put_data", [0], b"x") == ((42,), b"")


# what the host's first bytes may do to a board that is just starting, whose prompt still listens


def test_a_greeting_holds_no_ctrl_c() -> None:
    entry = wire.COMMAND["hello"]
    numbers = {harmless_number() for _ in range(300)}
    assert len(numbers) > 250
    for number in numbers:
        payload = wire.encode(entry, (wire.PROTOCOL_VERSION, number))
        assert all(3 not in wire.frame(sequence, entry[1], payload) for sequence in (1, 2, 4, 5, 6, 7))


def test_no_command_has_ctrl_c_for_its_number(tmp_path: Path) -> None:
    board = Client(Session(Pipe(tmp_path / "flash"), lambda: 0.0))
    assert 3 not in {board.session._next_sequence() for _ in range(600)}


# a line that damages bytes: what arrives is right, or the host says why not


@pytest.mark.slow
@pytest.mark.seeds(0, 1, 2)
def test_runs_over_a_bad_line_are_complete(tmp_path: Path, seed: int) -> None:
    pipe = Pipe(tmp_path / "flash", Noise(f"to {seed}", 0.01), Noise(f"from {seed}", 0.01))
    samples, end = follow(started(pipe))
    assert [sample.index for sample in samples] == list(range(pipe.run_samples))
    assert (end.fault, end.lost) == (0, ())


@pytest.mark.long
@pytest.mark.parametrize("kind", FAULTS)
def test_five_percent_is_survived_or_said(tmp_path: Path, kind: str) -> None:
    pipe = Pipe(tmp_path / "flash")
    board, old = ready(pipe)
    run = board.start("feed", wire.record_crc(old))
    pipe.disturb(Noise(f"to {kind}", 0.05, (kind,)), Noise(f"from {kind}", 0.05, (kind,)))
    follower = MotionFollower(board, run)
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
