"""A bad cable and a pulled one, a silent board, and a whole recorded session replayed both ways."""

from __future__ import annotations

import os
import subprocess
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from armtempo.basics.errors import BoardError
from armtempo.encoding import encode
from armtempo.link import Opening, open_board, traffic
from armtempo.link.board_messages import Done, Event, Sample
from armtempo.link.session import Session
from armtempo.link.traffic import FROM_BOARD, TO_BOARD, Chunk
from armtempo.link.transport import SerialTransport
from armtempo.planning import point_to_point
from armtempo.report import run_folder, run_reader
from armtempo.robot import arm_state, running
from armtempo.robot.stop_request import StopRequest
from armtempo.robot.store import store
from armtempo.simulator import LaunchOptions, launch
from armtempo_shared import limits, wire
from armtempo_shared.messages import MAX_COMMAND

from tests import interpreters
from tests.inprocess import Noise, clean, replay
from tests.system import commandline
from tests.system.commandline import SLOW_S, armtempo, small_plan, start, wait_for
from tests.system.relay import Relay, ReplayTransport


def begun(port: str, folder: Path, lines: int) -> subprocess.Popen[str]:
    """A run of some seconds whose file of samples has that many lines."""
    file = small_plan(folder / "small.json", (90.0, -75.0, 50.0))
    armtempo("home", "--arm", "paper", "--port", port, folder=folder)
    process = start("run", file, "--port", port, folder=folder)
    path = folder / "runs" / "small-001" / "samples-01.csv"
    wait_for(lambda: path.is_file() and path.read_text().count("\n") >= lines, "the first samples")
    return process


def test_run_over_a_bad_cable_is_complete(tmp_path: Path) -> None:
    """Bytes are lost, doubled, changed and cut off; each by itself is tried by tests/host/test_link.py."""
    file = small_plan(tmp_path / "small.json")
    to_board, from_board = (Noise(way, 0.004, ("lose", "double", "flip", "cut")) for way in ("to", "from"))
    with launch() as board, Relay(board.port, tmp_path / "port", to_board, from_board) as relay:
        armtempo("home", "--arm", "paper", "--port", relay.port, folder=tmp_path)
        output = armtempo("run", file, "--port", relay.port, folder=tmp_path)
    assert "complete" in output
    assert to_board.hits + from_board.hits > 3
    samples = run_reader.load(tmp_path / "runs" / "small-001").repetitions[0]
    assert samples.index.tolist() == list(range(len(samples.index)))
    assert samples.state == run_folder.COMPLETE


def test_cable_pulled_during_a_run_and_put_back(tmp_path: Path) -> None:
    with (
        launch(LaunchOptions(virtual_time=False, instant_flash=True)) as board,
        Relay(board.port, tmp_path / "port", clean, clean) as relay,
    ):
        process = begun(relay.port, tmp_path, lines=8)
        relay.unplug()
        time.sleep(1.0)
        relay.plug()
        out, error = process.communicate(timeout=SLOW_S)
    assert process.returncode == 0, out + error
    assert "waiting for it to come back" in error
    assert "complete" in out
    samples = run_reader.load(tmp_path / "runs" / "small-001").repetitions[0]
    assert samples.index.tolist() == list(range(len(samples.index)))
    assert samples.time_s[-1] > 3.0


def test_interrupt_while_the_cable_is_out(tmp_path: Path) -> None:
    with (
        launch(LaunchOptions(virtual_time=False, instant_flash=True)) as board,
        Relay(board.port, tmp_path / "port", clean, clean) as relay,
    ):
        process = begun(relay.port, tmp_path, lines=5)
        relay.unplug()
        process.terminate()
        time.sleep(0.5)
        process.terminate()
        out, error = process.communicate(timeout=SLOW_S)
    assert process.returncode == 130, out + error
    assert len(run_reader.load(tmp_path / "runs" / "small-001").repetitions[0].index) >= 4


def test_a_board_that_does_not_answer(tmp_path: Path) -> None:
    """It is given up after 2 s; on a loaded machine the command itself takes longer."""
    ours, theirs = os.openpty()
    try:
        command = commandline.start("status", "--port", os.ttyname(theirs), folder=tmp_path)
        done = commandline.ended(command, within_s=30.0)
    finally:
        os.close(ours)
        os.close(theirs)
    done.said("does not answer within 2 s", "check the cable", "reset a board that hangs")
    assert done.exit_code == 1


# A whole recorded session, replayed both ways: the host's bytes to a board, the board's bytes to the host


TRAFFIC = pytest.mark.xdist_group("traffic")  # what they share is made once

AWAY_DEG = np.array([20.0, -10.0, 15.0])
INTERPRETERS = [name for name in interpreters.AVAILABLE if name != "micropython-arm"]
WAIT_S = 60.0
LATE_TICKS = round(20e-6 * limits.TICK_HZ)
"""How late the sample interrupt may read the clock, so how far two recordings may differ."""
PASSING = {
    "hello": {"free_flash", "free_heap", "boot", "_tail"},
    "status": {"ticks"},
    "samples": {"first", "count"},
}
"""What may differ in an answer between two boards that did the same: times and memory."""


@dataclass
class Recording:
    """A traffic log, and what its host had of it."""

    path: Path
    samples: list[Sample] = field(default_factory=list)

    def chunks(self) -> list[Chunk]:
        """The log's lines."""
        return list(traffic.read_log(self.path))

    def data(self, direction: str) -> bytes:
        """All bytes of one direction."""
        return b"".join(chunk.data for chunk in self.chunks() if chunk.direction == direction)


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """A session in which no command was repeated, however late the board answered: repeats cannot be replayed."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("armtempo.link.session.REPEAT_INTERVAL_S", WAIT_S)
        made = _recorded(tmp_path_factory.mktemp("traffic") / "traffic.log")
    said = list(frames(made.data(TO_BOARD)))
    assert len(set(said)) == len(said)
    return made


def _recorded(path: Path) -> Recording:
    """Greeting, arm, home, upload, a refusal, a run, status, the store's commands; as ``--log-traffic`` writes it."""
    made = Recording(path)
    home_deg = np.array(commandline.ARM.home_deg)
    data = encode.motion_record(
        point_to_point.straight("go", home_deg, home_deg + AWAY_DEG, commandline.ARM), commandline.ARM
    )
    starter = interpreters.starter(INTERPRETERS[-1])
    with (
        launch(LaunchOptions(interpreter=starter)) as process,
        open_board(process.port, Opening(made.path)) as board,
    ):
        arm_state.configure(board, commandline.ARM, replace=True)
        arm_state.home(board, commandline.ARM)
        stored = store(board, [("go", data)])
        with StopRequest() as stop:
            replay(board, stored, stop, made.samples.append)
        board.status()
        board.rename("go", "gone")
        assert [entry.name for entry in board.stored()] == ["gone"]
        assert board.fetch("gone") == data
        board.remove("gone")
        running.send_stop(board)  # refused: nothing moves
    return made


def frames(data: bytes) -> Iterator[tuple[int, int, bytes]]:
    """All frames of one direction; there must be nothing else."""
    parser = wire.Parser(MAX_COMMAND)
    parser.feed(data)
    while (frame := parser.next()) is not None:
        yield frame
    assert parser.bad == 0


def decoded(frame: tuple[int, int, bytes]) -> tuple[str, dict[str, Any]]:
    """Name of a reply or event and its fields: for an answer its command's name and its own fields."""
    entry = wire.EVENT_BY_ID[frame[1]]
    values, tail = wire.decode(entry, frame[2])
    name = entry[0]
    if name == "ok":
        entry = wire.ANSWER_BY_ID[values[0]]
        name = entry[0]
        values, tail = wire.decode(entry, tail)
    return name, {**dict(zip(entry[3], values, strict=True)), "_tail": tail}


REPLIES = tuple(wire.EVENT[name][1] for name in ("ok", "error"))
DONE = wire.EVENT["done"][1]


def count(data: bytes) -> tuple[int, int]:
    """How many replies and ends of a run these bytes of the board hold."""
    numbers = [number for _, number, _ in frames(data)]
    return sum(number in REPLIES for number in numbers), numbers.count(DONE)


def say_again(chunks: list[Chunk], port: str) -> bytes:
    """Say to a board what the host said, each word when as much has been answered; gives what it answers."""
    transport = SerialTransport(port)
    recorded, heard = b"", b""
    try:
        for chunk in [*chunks, Chunk(0.0, TO_BOARD, b"")]:
            if chunk.direction == FROM_BOARD:
                recorded += chunk.data
                continue
            limit_s = time.monotonic() + WAIT_S
            while any(have < wanted for have, wanted in zip(count(heard), count(recorded), strict=True)):
                assert time.monotonic() < limit_s, chunk
                heard += transport.read(0.05)
            transport.write(chunk.data)
        return heard
    finally:
        transport.close()


@TRAFFIC
def test_a_board_answers_the_host_s_bytes_in_the_same_way(recording: Recording) -> None:
    """On another interpreter than the recorded one, where there are two."""
    with launch(LaunchOptions(interpreter=interpreters.starter(INTERPRETERS[0]))) as process:
        answers = say_again(recording.chunks(), process.port)
    recorded, again = (list(frames(data)) for data in (recording.data(FROM_BOARD), answers))
    pairs = zip(
        *([frame for frame in found if frame[1] in REPLIES] for found in (recorded, again)), strict=True
    )
    for one, other in pairs:
        assert one[0] == other[0]
        _compare(decoded(one), decoded(other))
    samples, others = (_samples(found) for found in (recorded, again))
    assert list(samples) == list(others) == list(range(len(recording.samples)))
    for index, sample in samples.items():
        assert abs(sample["ticks"] - others[index]["ticks"]) <= LATE_TICKS
        assert np.max(np.abs(_stand(sample) - _stand(others[index]))) <= 1


def _compare(one: tuple[str, dict[str, Any]], other: tuple[str, dict[str, Any]]) -> None:
    name, fields = one
    assert name == other[0]
    moving = name == "status" and wire.STATES[fields["state"]] in ("moving", "braking")
    passing = set(fields) if moving else PASSING.get(name, set())
    for key, value in fields.items():
        assert key in passing or value == other[1][key], (name, key)


def _samples(found: list[tuple[int, int, bytes]]) -> dict[int, dict[str, Any]]:
    samples = [fields for name, fields in map(decoded, found) if name == "sample"]
    return {fields["index"]: fields for fields in samples}


def _stand(sample: dict[str, Any]) -> np.ndarray:
    return np.frombuffer(sample["_tail"], "<i4")


@TRAFFIC
def test_the_host_takes_the_board_s_bytes_in_the_same_way(recording: Recording) -> None:
    """The host's own link says the recorded words again, byte for byte, and understands the same."""
    chunks = recording.chunks()
    session = Session(ReplayTransport(chunks))
    events: list[Event] = []
    said = 0
    for _, number, payload in frames(recording.data(TO_BOARD)):
        entry = wire.COMMAND_BY_ID[number]
        values, tail = wire.decode(entry, payload)
        for _ in chunks:  # each look takes one of them or less; the host's next word drops the rest
            event = session.poll(0.0)
            events += [event] if event else []
        with suppress(BoardError):  # the board refuses again what it refused
            session.command(entry[0], values, tail)
        said += 1
    events.extend(session.events)
    assert said >= 18
    assert session.frames_bad == 0
    assert [event for event in events if isinstance(event, Sample)] == recording.samples
    (done,) = (event for event in events if isinstance(event, Done))
    assert done.positions == recording.samples[-1].positions


@pytest.mark.parametrize("piece", [1, 7, 1 << 20])
@TRAFFIC
def test_the_decoder_says_the_same_however_the_bytes_are_cut(recording: Recording, piece: int) -> None:
    wanted = [line.split("\t")[3] for line in recording.path.read_text().splitlines()[1:]]
    for direction in (TO_BOARD, FROM_BOARD):
        decoder = traffic.Decoder()
        data = recording.data(direction)
        words = [
            line
            for at in range(0, len(data), piece)
            for line in decoder.feed(direction, data[at : at + piece])
        ]
        chunks = zip(recording.chunks(), wanted, strict=True)
        told = [text for chunk, text in chunks if chunk.direction == direction and text]
        assert "; ".join(words) == "; ".join(told)


@TRAFFIC
def test_monitor_shows_what_was_written(recording: Recording, tmp_path: Path) -> None:
    shown = commandline.armtempo("monitor", recording.path, folder=tmp_path).splitlines()
    lines = [line.split("\t") for line in recording.path.read_text().splitlines()[1:]]
    assert "; ".join(line[13:] for line in shown) == "; ".join(words for *_, words in lines if words)
    when = dict.fromkeys(
        f"{float(seconds):10.4f} {direction} " for seconds, direction, _, words in lines if words
    )
    assert list(dict.fromkeys(line[:13] for line in shown)) == list(when)
    text = "\n".join(shown)
    for word in (
        "hello",
        "put_begin",
        "home",
        "start",
        "sample run=1 index=0",
        "done run=1",
        "ok status",
        "error stop",
    ):
        assert word in text
