"""Commands, runs and samples over a good line and a broken one; refusals in words; the traffic log."""

from __future__ import annotations

import os
import random
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from threading import Event, Thread
from typing import Any

import pytest
from armtempo.basics.errors import BoardError, InputError, LinkError, NoAnswerError, OtherBoardError
from armtempo.link import Client, traffic
from armtempo.link.board_messages import Sample
from armtempo.link.client import harmless_number
from armtempo.link.follow import Follower, RunEnd
from armtempo.link.refusal import refusal
from armtempo.link.session import Session
from armtempo.link.transport import SerialTransport
from armtempo.records.encoded_motion import MotionKey
from armtempo.robot import stored_motion
from armtempo.robot.board import Board
from armtempo.robot.stop_request import StopRequest
from armtempo_shared import wire
from armtempo_shared.limits import MAX_MOTION_BYTES
from armtempo_shared.meanings import VALUES

from tests.inprocess import ARM, FAULTS, Noise, Pipe, connect, follow, random_motion, ready, started
from tests.system.relay import ReplayTransport

NUMBERS = sorted(VALUES.keys() - {"too_fast", "too_long", "pin_taken"})
"""Names of codes whose number is said as the table of meanings has it."""


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


@pytest.mark.slow
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
    run = board.start("feed", wire.record_crc(data)).run
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
    run = board.start("feed", wire.record_crc(data)).run
    pipe.wait_away(45.0)
    follower = Follower(board, run)
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
    pipe.wait_away(18.0, buffer=4096)
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
    run = board.start("feed", wire.record_crc(data), wire.START_HOMING).run
    assert board.status().known == 7
    samples = list(Follower(board, run).samples())
    assert samples[0].positions.commanded_steps == (7, 7, 7)
    assert board.status().known == 1


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
        stored_motion.stop(board, now=False)
    assert pipe.clock() - begin_s < 15.0


def test_what_was_to_stop_before_does_not_start(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    board, data = ready(pipe)
    stop = StopRequest()
    stop.wanted = True
    with pytest.raises(KeyboardInterrupt):
        stored_motion.replay(board, MotionKey("feed", wire.record_crc(data)), stop)
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
def test_a_hundred_uploads_over_a_bad_line_arrive_identical(tmp_path: Path) -> None:
    to_board, from_board = Noise("to", 0.01), Noise("from", 0.01)
    pipe = Pipe(tmp_path / "flash", to_board, from_board)
    board = connect(pipe)
    numbers = random.Random(1)
    board.upload(wire.ARM_RECORD_NAME, ARM)
    for number in range(100):
        data = random_motion(numbers, segments=numbers.randrange(1, 4), joints=1)
        board.upload("feed", data)
        assert (tmp_path / "flash" / "feed.atm").read_bytes() == data, f"upload {number}"
    assert to_board.hits > 200
    assert from_board.hits > 30


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


@pytest.mark.parametrize("name", NUMBERS)
def test_every_number_is_said_with_what_it_is(name: str) -> None:
    code = wire.ERROR_CODES[name]
    _, meaning, cure = wire.ERRORS[code]
    error = refusal("no", code, 1, 4711)
    assert error.code == code
    assert str(error) == f"no: {meaning} (joint 2) [{VALUES[name]}: 4711]; {cure}"


def test_a_pin_is_named_with_what_can_hold_it() -> None:
    code = wire.ERROR_CODES["pin_taken"]
    assert "(joint 2) [PE9: encoder 1]; give another pin" in str(refusal("no", code, 1, 0x49))
    assert "[PA0: the button, STEP of channel 6]" in str(refusal("no", code))
    assert "[PE12: ENABLE of the drivers]" in str(refusal("no", code, value=0x4C))
    assert "[PD0: it, or its timer, has another output or input already]" in str(
        refusal("no", code, value=0x30)
    )


def test_a_limit_of_the_arm_is_not_taken_for_one_of_the_board() -> None:
    code = wire.ERROR_CODES["too_fast"]
    assert "speed limit in the arm file that the board has (joint 2) [steps/s needed: 395]; " in str(
        refusal("no", code, 1, 395)
    )
    assert "together need more steps per second than the board can make [steps/s needed: 3950]; " in str(
        refusal("no", code, 255, 3950)
    )


def test_what_has_no_number_or_joint_says_none() -> None:
    assert str(refusal("no", wire.ERROR_CODES["not_moving"])) == "no: nothing is moving; no action needed"
    assert "error 200, unknown to this version [7]" in str(refusal("no", 200, value=7))


@pytest.mark.parametrize(
    ("joint", "value", "words"),
    [
        (255, MAX_MOTION_BYTES, "it takes 16384 bytes at most"),
        (0, 1 << 38, "its numbers reach 274877906944"),
    ],
)
def test_a_motion_that_does_not_fit_says_by_how_much(joint: int, value: int, words: str) -> None:
    text = str(refusal("no", wire.ERROR_CODES["too_long"], joint, value))
    assert f"[{words}]; lower refine, use shared timing or fewer via points, or split it" in text


def test_a_record_larger_than_the_board_takes(tmp_path: Path) -> None:
    board, _ = ready(Pipe(tmp_path / "flash"))
    with pytest.raises(BoardError, match=r"refused 'put_begin'.*\[it takes 16384 bytes at most"):
        board.upload("big", bytes(MAX_MOTION_BYTES + 1))


def test_a_command_for_which_the_board_has_no_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is answered by its own code."""
    pipe = Pipe(tmp_path / "flash")
    board, data = ready(pipe)

    def short_of_memory(self: Any, name: str) -> Any:
        raise MemoryError

    monkeypatch.setattr(pipe._later["armtempo_board.storage.store"].Store, "motion", short_of_memory)
    with pytest.raises(BoardError, match=r"refused 'start'.*ran out of memory in this command"):
        board.start("feed", wire.record_crc(data))


def test_recorded_traffic_replays(tmp_path: Path) -> None:
    path = tmp_path / "traffic.log"
    pipe = Pipe(tmp_path / "flash")
    with traffic.LogFile(path) as log:
        logged = traffic.LoggedTransport(pipe, log)
        seen = [Client(Session(logged, pipe.clock), 1).hello()]
    path.write_text(path.read_text(encoding="utf-8") + "0.1\t<\tcut", encoding="utf-8")
    replayed = Client(Session(ReplayTransport(traffic.read_log(path))), 1)
    assert replayed.hello() == seen[0]
    with pytest.raises(LinkError, match="replay"):
        replayed.status()
    assert f"ok hello protocol={wire.PROTOCOL_VERSION}" in path.read_text(encoding="utf-8")


def test_traffic_log_refuses_other_files(tmp_path: Path) -> None:
    path = tmp_path / "x.log"
    with pytest.raises(InputError, match="cannot be read"):
        list(traffic.read_log(path))
    path.write_text("something\n")
    with pytest.raises(InputError, match="not a traffic log"):
        list(traffic.read_log(path))
    path.write_text(f"{traffic.HEADER}\n1.0\t!\t00\t\n")
    with pytest.raises(InputError, match="line 2"):
        list(traffic.read_log(path))


def test_every_message_has_words() -> None:
    for entry in wire.COMMAND.values():
        payload = bytes(64) if entry[4] else bytes(len(wire.encode(entry, [0] * len(entry[3]))))
        assert entry[0] in traffic.describe(traffic.TO_BOARD, 1, entry[1], payload)
    assert "unknown" in traffic.describe(traffic.FROM_BOARD, 1, 0xEE, b"")
    assert "malformed" in traffic.describe(traffic.FROM_BOARD, 1, wire.EVENT["done"][1], b"x")


def test_a_log_on_a_full_disk_is_cut_short_and_the_traffic_goes_on(tmp_path: Path) -> None:
    full = Path("/dev/full")
    if not full.exists():  # not on every system
        return
    pipe = Pipe(tmp_path / "flash")
    with pytest.raises(InputError, match="cut short: No space left"), traffic.LogFile(full) as log:  # noqa: PT012
        board = Client(Session(traffic.LoggedTransport(pipe, log), pipe.clock), 1)
        board.hello()
        board.status()
    with pytest.raises(InputError, match="cannot be written"):
        traffic.LogFile(tmp_path)


def prepared(pipe: Pipe) -> tuple[Client, MotionKey]:
    """A board with known positions and a motion."""
    board, data = ready(pipe)
    return board, MotionKey("feed", wire.record_crc(data))


def replay(
    board: Client, stored: MotionKey, at_20: Callable[[], None], stop: StopRequest | None = None
) -> tuple[RunEnd, list[int]]:
    """Run it; ``at_20`` is called with the sample number 20."""
    indices: list[int] = []

    def take(sample: Sample, duration_s: float) -> None:
        indices.append(sample.index)
        if sample.index == 20:
            at_20()

    return stored_motion.replay(board, stored, stop or StopRequest(), take), indices


@pytest.mark.slow
@pytest.mark.parametrize("trouble", ["unplug_for", "silence_for"])
def test_trouble_is_told_once_and_its_end_once(tmp_path: Path, trouble: str) -> None:
    pipe = Pipe(tmp_path / "flash")
    board, stored = prepared(pipe)
    told: list[str] = []
    board.session.tell = told.append
    end, indices = replay(board, stored, lambda: getattr(pipe, trouble)(9.0))
    assert [text.rsplit(" ", 1)[1] for text in told] == ["back", "again"]
    assert indices == list(range(pipe.run_samples))
    assert end.samples_lost == 0


@pytest.mark.slow
def test_a_board_that_stays_silent_is_given_up_after_a_minute(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    board, stored = prepared(pipe)
    told: list[str] = []
    board.session.tell = told.append
    begin_s = pipe.clock()
    with pytest.raises(LinkError, match="did not answer"):
        replay(board, stored, lambda: pipe.silence_for(1e6))
    assert len(told) == 1
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
    assert board.session.reopen is not None


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
    told: list[str] = []
    board.session.tell = told.append
    run = board.start("feed", wire.record_crc(data)).run
    indices = []
    follower = Follower(board, run)
    for sample in follower.samples():
        indices.append(sample.index)
        if sample.index in (20, 40):
            pipe.unplug_for(1.5)
    assert indices == list(range(pipe.run_samples))
    assert [text.split()[0] for text in told] == ["the", "connected"] * 2


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
    with client.session.turns:
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
    monkeypatch.setattr("armtempo.robot.board.TURN_S", 0.01)
    pipe = Pipe(tmp_path / "flash")
    client = connect(pipe)
    client.session.reopen = lambda: pipe
    with client.session.turns:
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
