"""The host's end of the link against the board's own link, store and commands."""

from __future__ import annotations

import os
import random
from pathlib import Path

import pytest
from armtempo import deploy, operate
from armtempo.errors import BoardError, InputError, LinkError
from armtempo.interrupt import StopRequest
from armtempo.link import Board, diagnose, ports, traffic
from armtempo.link.follow import Follower, RunEnd
from armtempo.link.messages import Sample
from armtempo.link.replay import ReplayTransport
from armtempo.link.session import NoAnswer, Session
from armtempo.link.transport import SerialTransport
from armtempo_shared import armrecord, motion, wire

from tests.board.scripts import stand_in
from tests.inprocess import FAULTS, Noise, Pipe, connect

ARM = stand_in.arm(3)


def random_motion(numbers: random.Random, segments: int = 6, joints: int = 3) -> bytes:
    points = [[numbers.randrange(2**40) for _ in range(segments + 5)] for _ in range(joints)]
    return motion.pack(5, points, points, segments, 1, 0, armrecord.unpack(ARM)[2])


def ready(pipe: Pipe) -> tuple[Board, bytes]:
    """A board with arm, motion ``feed`` and known positions."""
    board = connect(pipe)
    board.upload(wire.ARM_RECORD_NAME, ARM)
    data = random_motion(random.Random(5))
    board.upload("feed", data)
    board.home([0, 0, 0])
    return board, data


def follow(board: Board, data: bytes) -> tuple[list[Sample], RunEnd]:
    run, _ = board.start("feed", wire.record_crc(data))
    follower = Follower(board, run)
    samples = list(follower.samples())
    assert follower.end is not None
    return samples, follower.end


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


def test_run_gives_every_sample_once_in_order(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    samples, end = follow(*ready(pipe))
    assert [sample.index for sample in samples] == list(range(pipe.run_samples))
    assert (end.fault, end.lost, end.received) == (0, (), pipe.run_samples)
    assert samples[-1].stand == end.stand


def test_repeated_command_acts_once(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    board, data = ready(pipe)
    lost = [True]
    send = pipe._send
    pipe._send = lambda way, frame: None if way == 1 and lost and lost.pop() else send(way, frame)  # type: ignore[method-assign]
    run, _ = board.start("feed", wire.record_crc(data))
    assert board.session.repeats == 1
    assert (run, pipe.app.engine.calls.count("start")) == (1, 1)


def test_thousand_uploads_over_a_bad_line_arrive_identical(tmp_path: Path) -> None:
    to_board, from_board = Noise("to", 0.01), Noise("from", 0.01)
    pipe = Pipe(tmp_path / "flash", to_board, from_board)
    board = connect(pipe)
    numbers = random.Random(1)
    board.upload(wire.ARM_RECORD_NAME, ARM)
    for number in range(1000):
        data = random_motion(numbers, segments=numbers.randrange(1, 4), joints=1)
        board.upload("feed", data)
        assert (tmp_path / "flash" / "feed.atm").read_bytes() == data, f"upload {number}"
    assert to_board.hits > 2000
    assert from_board.hits > 300


@pytest.mark.parametrize("seed", range(8))
def test_runs_over_a_bad_line_are_complete(tmp_path: Path, seed: int) -> None:
    pipe = Pipe(tmp_path / "flash", Noise(f"to {seed}", 0.01), Noise(f"from {seed}", 0.01))
    samples, end = follow(*ready(pipe))
    assert [sample.index for sample in samples] == list(range(pipe.run_samples))
    assert (end.fault, end.lost) == (0, ())


def test_ten_minutes_to_a_host_that_pauses_two_seconds_lose_nothing(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    pipe.run_samples = 6000
    board, data = ready(pipe)
    run, _ = board.start("feed", wire.record_crc(data))
    follower = Follower(board, run)
    indices = []
    for sample in follower.samples():
        indices.append(sample.index)
        if sample.index % 50 == 49:
            pipe.wait_away(2.0)
    assert indices == list(range(6000))


def test_gap_is_counted_where_the_board_ran_out_of_memory(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    pipe.run_samples = 500
    board, data = ready(pipe)
    run, _ = board.start("feed", wire.record_crc(data))
    pipe.wait_away(45.0)
    follower = Follower(board, run)
    samples = list(follower.samples())
    assert follower.end is not None
    missing = set(range(500)) - {sample.index for sample in samples}
    assert missing
    assert {index for first, count in follower.end.lost for index in range(first, first + count)} == missing
    assert follower.end.samples_lost + follower.end.received == 500


def test_what_arrived_is_not_lost_though_the_board_has_let_it_go(tmp_path: Path) -> None:
    """The system of a host that is stopped goes on reading: then the board keeps only younger samples."""
    pipe = Pipe(tmp_path / "flash")
    pipe.run_samples = 250
    board, data = ready(pipe)
    run, _ = board.start("feed", wire.record_crc(data))
    follower = Follower(board, run)
    pipe.wait_away(18.0, buffer=4096)
    assert [sample.index for sample in follower.samples()] == list(range(250))


def test_fault_ends_the_run(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    board, data = ready(pipe)
    run, _ = board.start("feed", wire.record_crc(data))
    follower = Follower(board, run)
    for sample in follower.samples():
        if sample.index == 10:
            pipe.app.engine.fault, pipe.app.engine.fault_joint = wire.ERROR_CODES["following"], 1
            pipe.app.engine.finish()
    assert follower.end is not None
    assert (follower.end.fault, follower.end.fault_joint) == (wire.ERROR_CODES["following"], 1)


def test_homing_motion_starts_anywhere_and_leaves_nothing_known(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    board = connect(pipe)
    board.upload(wire.ARM_RECORD_NAME, ARM)
    data = random_motion(random.Random(5))
    board.upload("feed", data)
    board.home([7, None, None])
    with pytest.raises(BoardError, match="position is unknown"):
        board.start("feed", wire.record_crc(data))
    run, _ = board.start("feed", wire.record_crc(data), wire.START_HOMING)
    assert board.status().known == 7
    samples = list(Follower(board, run).samples())
    assert samples[0].stand.commanded_steps == (7, 7, 7)
    assert board.status().known == 1


def test_cable_out_during_a_run_costs_no_sample(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    board, data = ready(pipe)
    told: list[str] = []
    board.session.tell = told.append
    run, _ = board.start("feed", wire.record_crc(data))
    indices = []
    follower = Follower(board, run)
    for sample in follower.samples():
        indices.append(sample.index)
        if sample.index in (20, 40):
            pipe.unplug_for(1.5)
    assert indices == list(range(pipe.run_samples))
    assert [text.split()[0] for text in told] == ["the", "connected"] * 2


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


def test_board_that_started_anew_is_found_out(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    board, data = ready(pipe)

    def restart(sample: Sample, duration_s: float) -> None:
        if sample.index == 20:
            pipe.start_board()

    stored = operate.Stored("feed", wire.record_crc(data))
    with pytest.raises(LinkError, match="started anew during the motion"):
        operate.replay(board, stored, StopRequest(), restart)


def test_silent_board_is_reported_in_time(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    board = connect(pipe)
    pipe._send = lambda way, frame: None  # type: ignore[method-assign]
    begin_s = pipe.clock()
    with pytest.raises(NoAnswer, match="did not answer 'status'"):
        board.status()
    assert pipe.clock() - begin_s < 4.0


class Silent:
    """A port on which ``answer`` comes after the first byte is sent."""

    name = "there"

    def __init__(self, answer: bytes = b"") -> None:
        self.answer = answer

    def read(self, timeout_s: float) -> bytes:
        data, self.answer = self.answer, b""
        return data

    def write(self, data: bytes) -> None: ...

    def close(self) -> None: ...


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (b"", "does not answer within 2 s"),
        (
            b'\r\n>>> \r\nMicroPython v1.29.0 on 2026-01-01; STM32F4DISC\r\nType "help()"\r\n>>> ',
            "armtempo deploy",
        ),
        (b"raw REPL; CTRL-B to exit\r\n>", "armtempo deploy"),
        (b"$GPGGA,1234,N*5B\r\n", "something else"),
        (b"\xa5\x10", "check cable"),
        (b"\x5d\x00\x01~\x01\x01\x003.4.0; MicroPython v1.29.0", "check cable"),
    ],
)
def test_what_else_sits_on_a_port(answer: bytes, words: str) -> None:
    assert words in str(diagnose.explain(Silent(answer), b""))


def test_port_that_does_not_exist() -> None:
    with pytest.raises(InputError, match="there is no port /dev/nowhere"):
        SerialTransport("/dev/nowhere")
    with pytest.raises(InputError, match="not a port or URL"):
        SerialTransport("nonsense://x")


def test_port_in_use() -> None:
    master, slave = os.openpty()
    try:
        first = SerialTransport(os.ttyname(slave))
        with pytest.raises(LinkError, match="in use by another program"):
            SerialTransport(os.ttyname(slave))
        with pytest.raises(LinkError, match="in use by another program"):  # mpremote is not asked
            deploy.deploy(os.ttyname(slave), False, print, lambda *_: None)
        first.close()
        SerialTransport(os.ttyname(slave)).close()
    finally:
        os.close(master)
        os.close(slave)


def test_found_ports_put_boards_first() -> None:
    found = ports.find_ports()
    assert [port.board for port in found] == sorted([port.board for port in found], reverse=True)


def test_recorded_traffic_replays(tmp_path: Path) -> None:
    path = tmp_path / "traffic.log"
    pipe = Pipe(tmp_path / "flash")
    with traffic.LogFile(path) as log:
        logged = traffic.LoggedTransport(pipe, log)
        seen = [Board(Session(logged, pipe.clock), 1).hello()]
    path.write_text(path.read_text(encoding="utf-8") + "0.1\t<\tcut", encoding="utf-8")
    replayed = Board(Session(ReplayTransport(traffic.read_log(path))), 1)
    assert replayed.hello() == seen[0]
    with pytest.raises(LinkError, match="replay"):
        replayed.status()
    assert "ok hello protocol=1" in path.read_text(encoding="utf-8")


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


def test_a_motion_that_does_not_end_is_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pipe = Pipe(tmp_path / "flash")
    board, data = ready(pipe)
    monkeypatch.setattr(pipe, "_move", lambda: None)
    with pytest.raises(LinkError, match="its motion clock stands still"):
        follow(board, data)


def test_a_board_that_does_not_stop_is_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pipe = Pipe(tmp_path / "flash")
    board, data = ready(pipe)
    board.start("feed", wire.record_crc(data))
    monkeypatch.setattr(pipe.app.engine, "brake", lambda: None)
    monkeypatch.setattr(pipe.app.engine, "freeze", lambda: None)
    begin_s = pipe.clock()
    pipe.run_samples = 10_000
    with pytest.raises(LinkError, match="does not; switch off"):
        operate.stop(board, now=False)
    assert pipe.clock() - begin_s < 15.0


def test_a_cable_that_is_out_does_not_keep_who_wants_an_end(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    board, data = ready(pipe)
    stop = StopRequest()
    ended_s = [0.0]

    def unplug(sample: Sample, duration_s: float) -> None:
        pipe.unplug_for(1000.0)
        stop.wanted = True
        ended_s[0] = pipe.clock()

    with pytest.raises(LinkError, match="could not be told to stop"):
        operate.replay(board, operate.Stored("feed", wire.record_crc(data)), stop, unplug)
    assert pipe.clock() - ended_s[0] < 10.0


def test_what_was_to_stop_before_does_not_start(tmp_path: Path) -> None:
    pipe = Pipe(tmp_path / "flash")
    board, data = ready(pipe)
    stop = StopRequest()
    stop.wanted = True
    with pytest.raises(KeyboardInterrupt):
        operate.replay(board, operate.Stored("feed", wire.record_crc(data)), stop)
    assert pipe.app.engine.calls.count("start") == 0


def test_a_log_on_a_full_disk_is_cut_short_and_the_traffic_goes_on(tmp_path: Path) -> None:
    full = Path("/dev/full")
    if not full.exists():  # not on every system
        return
    pipe = Pipe(tmp_path / "flash")
    with pytest.raises(InputError, match="cut short: No space left"), traffic.LogFile(full) as log:  # noqa: PT012
        board = Board(Session(traffic.LoggedTransport(pipe, log), pipe.clock), 1)
        board.hello()
        board.status()
    with pytest.raises(InputError, match="cannot be written"):
        traffic.LogFile(tmp_path)


def test_what_is_no_serial_port_is_said_to_be_none(tmp_path: Path) -> None:
    for path in (tmp_path, Path("/dev/null"), tmp_path / "file"):
        if path.name == "file":
            path.write_text("")
        with pytest.raises(InputError, match=f"{path} is not a serial port"):
            SerialTransport(str(path))
    with pytest.raises(InputError, match="names no folder"):
        ports.sim_flash("sim:")


@pytest.mark.parametrize("kind", FAULTS)
def test_five_percent_is_survived_or_said(tmp_path: Path, kind: str) -> None:
    pipe = Pipe(tmp_path / "flash")
    board, old = ready(pipe)
    run, _ = board.start("feed", wire.record_crc(old))
    pipe.disturb(Noise(f"to {kind}", 0.05, (kind,)), Noise(f"from {kind}", 0.05, (kind,)))
    follower = Follower(board, run)
    indices: list[int] = []
    new = random_motion(random.Random(6))
    said = ""
    try:
        for sample in follower.samples():
            assert sample.stand.commanded_steps == (sample.index,) * 3
            indices.append(sample.index)
        assert follower.end is not None
        missing = [index for first, count in follower.end.lost for index in range(first, first + count)]
        assert sorted(indices + missing) == list(range(pipe.run_samples))
        board.upload("feed", new)
    except LinkError as error:
        said = str(error)
    assert not said or "damaged stretches received: check the cable" in said
    assert indices == sorted(set(indices))
    assert (tmp_path / "flash" / "feed.atm").read_bytes() in (old, new)
