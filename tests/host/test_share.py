"""Who has a port: the file that says so, its socket, and what a caller hears."""

from __future__ import annotations

import json
import os
import random
import socket
import stat
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from armtempo.basics.errors import BoardError, LinkError, NoAnswerError, PortError
from armtempo.link import Client, Opening
from armtempo.link.board_lock import BoardLock
from armtempo.link.board_messages import Levels
from armtempo.link.refusal import refusal
from armtempo.ports import caller, claim, claim_file
from armtempo.ports.caller import Caller, Ownership, ownership
from armtempo.ports.claim import PortClaim
from armtempo.ports.messages import REQUESTS, Field, LineReader, Message, check
from armtempo.ports.server import Server
from armtempo.robot import connect, running
from armtempo.robot.shared_board import SharedBoard
from armtempo.robot.sharing import Sharing
from armtempo_shared import wire

from tests import inprocess

ANY = Field("anything", lambda _: True, needed=False)
ECHO = {**REQUESTS, "echo": {"text": ANY, "refuse": ANY}}


def handle(request: Message) -> Message:
    """Answers as a board's owner might."""
    if request.get("refuse"):
        raise BoardError("refused", "ask again", 7)
    return {"echo": request.get("text")}


@pytest.fixture
def server() -> Iterator[Server]:
    found = Server(claim.new("/dev/p", "/dev/p", "/dev/p"), {"echo": handle}, ECHO)
    yield found
    found.close()


def test_a_request_is_answered_and_a_refusal_keeps_its_code(server: Server) -> None:
    with Caller(server.claim) as other:
        assert other.ask("echo", 5.0, text="é")["echo"] == "é"
        with pytest.raises(BoardError, match="refused") as refused:
            other.ask("echo", 5.0, refuse=True)
        assert refused.value.code == 7
        assert refused.value.hint == "ask again"
        with pytest.raises(LinkError, match="no request 'nonsense'"):
            other.ask("nonsense", 5.0)


def test_a_stop_brakes_unless_it_is_to_be_now() -> None:
    asked: list[object] = []

    def stop(request: Message) -> Message:
        asked.append((request["now"], request["by"]))
        return {"moving": True}

    server = Server(claim.new("/dev/p", "/dev/p", "/dev/p"), {"stop": stop})
    try:
        with Caller(server.claim) as other:
            board = SharedBoard(other)
            assert board.stop()
            assert board.stop(now=True, by="armtempo stop")
    finally:
        server.close()
    assert asked == [(False, "another program"), (True, "armtempo stop")]


def test_an_arm_that_no_other_program_can_stop_says_so_before_it_moves(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No folder for claims is this user's alone."""
    (tmp_path / "taken").write_text("")
    monkeypatch.setattr(claim_file, "folders", lambda: iter([str(tmp_path / "taken")]))
    told: list[str] = []

    @contextmanager
    def open_board(*_: object) -> Iterator[Client]:
        yield inprocess.connect(inprocess.Pipe(tmp_path / "flash"))

    monkeypatch.setattr(connect, "open_board", open_board)
    with connect.connect_now("/dev/p", None, Opening(tell=told.append)):
        assert len(told) == 1
        assert "not even 'armtempo stop'" in told[0]
        assert str(tmp_path / "taken") in told[0]


@pytest.mark.skipif(os.name != "posix", reason="modes are of POSIX")
def test_only_this_user_gets_in(server: Server) -> None:
    path = Path(server.claim.address)
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert stat.S_IMODE(path.parent.stat().st_mode) == 0o700
    for file in path.parent.glob("*.claim"):
        assert stat.S_IMODE(file.stat().st_mode) == 0o600
    os.chmod(path.parent, 0o755)
    try:
        assert claim.find("/dev/p", "/dev/p") is None  # such a folder is not trusted
    finally:
        os.chmod(path.parent, 0o700)


def test_a_token_is_asked_for_where_there_are_no_modes(monkeypatch: pytest.MonkeyPatch) -> None:
    """As on Windows: a port of localhost that every user reaches."""
    monkeypatch.setattr(claim, "LOCAL_SOCKETS", False)
    server = Server(claim.new("COM5", "COM5", "COM5"), {"echo": handle}, ECHO)
    try:
        assert len(server.claim.token) == 32
        with Caller(server.claim) as other:
            assert other.ask("echo", 5.0, text="1")["echo"] == "1"
        with socket.create_connection(("127.0.0.1", int(server.claim.address))) as stranger:
            stranger.sendall(b'{"id":1,"request":"echo"}\n{"id":2,"request":"hello","token":"x"}\n')
            lines = stranger.makefile()
            answers = lines.readline() + lines.readline()
        assert "say hello with the token first" in answers
        assert '"ok":true' not in answers
    finally:
        server.close()


def test_lives_hangs_died(server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    assert ownership(server.claim) is Ownership.ALIVE
    server.close()
    assert ownership(server.claim) is Ownership.DEAD
    monkeypatch.setattr(caller, "HUNG_S", 0.1)
    deaf = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    with deaf:
        deaf.bind(server.claim.address)
        deaf.listen()
        server.claim.write()
        silent(server.claim, -60.0)
        assert ownership(server.claim) is Ownership.ALIVE  # its sign of life is fresh: it is busy
        silent(server.claim, caller.HUNG_S + 1.0)
        assert ownership(server.claim) is Ownership.HUNG
        with pytest.raises(NoAnswerError, match="does not answer"):
            Caller(server.claim)
    server.claim.remove()
    Path(server.claim.address).unlink(missing_ok=True)


def silent(found: PortClaim, seconds: float) -> None:
    """Its program gave the last sign of life so long ago."""
    for path in found._files():
        os.utime(path, (time.time() - seconds,) * 2)


def test_a_sign_of_life_is_given_all_the_time(server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("armtempo.ports.server.BEAT_S", 0.05)
    silent(server.claim, 60.0)
    limit_s = time.monotonic() + 30.0
    while server.claim.silent_s() > 30.0:
        assert time.monotonic() < limit_s
        with Caller(server.claim) as other:  # also while callers come
            other.ask("echo", 5.0, text="1")


@pytest.mark.skipif(not claim.LOCAL_SOCKETS, reason="those of Windows wait by themselves")
def test_a_program_with_many_callers_is_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """Forty at once on a program that lets two wait: none takes it for one that hangs."""
    monkeypatch.setattr("armtempo.ports.server._BACKLOG", 1)
    server = Server(claim.new("/dev/p", "/dev/p", "/dev/p"), {"echo": handle}, ECHO)
    found: list[object] = []

    def ask() -> None:
        try:
            with Caller(server.claim) as other:
                found.append(other.ask("echo", 60.0, text="here")["echo"])
        except LinkError as error:
            found.append(error)

    monkeypatch.setattr(caller, "HUNG_S", 60.0)
    callers = [threading.Thread(target=ask) for _ in range(40)]
    for thread in callers:
        thread.start()
    for thread in callers:
        thread.join()
    server.close()
    assert found == ["here"] * len(callers)


def test_that_a_program_hangs_is_remembered_for_a_while(monkeypatch: pytest.MonkeyPatch) -> None:
    gone = claim.new("/dev/p", "/dev/p", "/dev/p")
    assert ownership(gone) is Ownership.DEAD
    caller.remember_hanging(gone.number)
    assert ownership(gone) is Ownership.HUNG  # it was not asked
    monkeypatch.setattr(caller, "_REMEMBERED_S", 0.0)
    assert ownership(gone) is Ownership.DEAD


def test_who_lost_the_port_uses_it_no_more(server: Server) -> None:
    server.check()
    taker = Server(claim.new("/dev/p", "/dev/p", "/dev/p"), {})
    time.sleep(0.05)
    taker.close()
    with pytest.raises(PortError, match="has taken /dev/p over"):
        server.check()  # also after the other one has given it up again
    with pytest.raises(PortError, match="has taken /dev/p over"):
        server.check()  # and at once again: who opens the port anew minds no error
    taker = Server(claim.new("/dev/p", "/dev/p", "/dev/p"), {})
    try:
        time.sleep(0.05)
        with pytest.raises(PortError, match="has taken /dev/p over"):
            server.check()
        server.close()
        found = claim.find("/dev/p", "/dev/p")
        assert found is not None
        assert found.number == taker.claim.number  # the first one's end leaves the second one's claim alone
    finally:
        taker.close()


def test_what_is_subscribed_comes_until_the_port_is_given_up(server: Server) -> None:
    with Caller(server.claim) as other:
        with pytest.raises(LinkError, match=r"topics is .*everything"):
            other.subscribe("everything")
        other.subscribe("sample")
        for index in range(3):
            server.publish("sample", {"index": index})
            server.publish("traffic", {"index": index})
        threading.Timer(0.1, server.close).start()
        assert [message["index"] for message in other.messages()] == [0, 1, 2]


@pytest.mark.parametrize("line", [b"nonsense\n", b"[1]\n", b'{"id":\n', b"\xff\xfe\n"])
def test_what_is_no_message_ends_that_connection_only(server: Server, line: bytes) -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as stranger:
        stranger.connect(server.claim.address)
        stranger.sendall(line)
        assert b"not a message" in stranger.recv(1000)
    with Caller(server.claim) as other:
        assert other.ask("echo", 5.0, text="still here")["echo"] == "still here"


def test_who_is_in_a_hurry_goes_first() -> None:
    """The holder takes its turn again and again without a pause, as a program that follows a run does."""
    turns, order, ended = BoardLock(), [], threading.Event()

    def talk() -> None:
        while not ended.is_set():
            with turns:
                time.sleep(0.001)
                order.append("talk")

    thread = threading.Thread(target=talk)
    thread.start()
    try:
        while not order:
            time.sleep(0.001)
        for _ in range(20):
            before = len(order)
            with turns.in_a_hurry(5.0) as mine:
                assert mine
                assert len(order) - before <= 1  # the turn that was under way
    finally:
        ended.set()
        thread.join()


def test_a_stop_comes_between_two_commands_of_a_request() -> None:
    """A request of many commands goes before one who talks all the time, and a stop waits for one command at most."""
    turns, order, asked, ended = BoardLock(), [], threading.Event(), threading.Event()

    def talk() -> None:
        while not ended.is_set():
            with turns:
                order.append("talk")
                time.sleep(0.001)

    def ask() -> None:
        with turns.by_turns(5.0) as mine:
            assert mine
            order.append("request")
            for _ in range(1000):
                with turns:
                    order.append("late" if turns._stopping else "ask")
                    asked.set()
                    time.sleep(0.001)
                if "stop" in order:
                    break
        order.append("end")

    threads = [threading.Thread(target=talk), threading.Thread(target=ask)]
    for thread in threads:
        thread.start()
    try:
        assert asked.wait(30.0)
        with turns.in_a_hurry(30.0, stops=True) as mine:
            assert mine
            order.append("stop")
        threads[1].join()
    finally:
        ended.set()
        threads[0].join()
    within = order[order.index("request") : order.index("end")]
    assert within.count("talk") <= 1, order  # that waited for the lock when the request came
    assert within.count("stop") == 1
    assert within.count("late") <= 1, order  # one that had passed the lock's queue when the stop came


class Owner:
    """What ``Sharing`` needs of a client; keeps what the board would have been told."""

    def __init__(self) -> None:
        transport = SimpleNamespace(name="/dev/p")
        self.session = SimpleNamespace(
            transport=transport, by_turns=self._turn, in_a_hurry=self._turn, listen=repr, guard=repr
        )
        self.told: list[tuple[object, ...]] = []
        self.rate = 1000

    @contextmanager
    def _turn(self, _wait_s: float, stops: bool = False) -> Iterator[bool]:
        yield True

    def speed(self, rate: int) -> None:
        """A change of speed."""
        self.told.append(("speed", rate))

    def set_output(self, number: int, value: int) -> None:
        """An output."""
        self.told.append(("output", number, value))

    def levels(self) -> Levels:
        """Of an arm without outputs and inputs."""
        return Levels(0, ())

    def stop(self, now: bool) -> None:
        """A stop."""
        self.told.append(("stop", now))


@pytest.fixture
def owner(monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[Owner, PortClaim]]:
    """A program that has a port, with a board that does as it is told."""
    client, failed = Owner(), []
    monkeypatch.setattr(running, "send_stop", lambda client, now: client.stop(now) is None)
    monkeypatch.setattr(threading, "excepthook", failed.append)
    shared = Sharing(cast(Any, client), cast(Any, lambda: SimpleNamespace(to_json=dict)), [], lambda: None)
    shared.open("/dev/p")
    found = claim.find("/dev/p", "/dev/p")
    assert found is not None
    yield client, found
    shared.close()
    assert not failed, "a thread of the owner ended in a traceback"


def answers(server: PortClaim, lines: list[bytes]) -> Iterator[Message]:
    """What the owner says to some lines that are messages, on one connection."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as stranger:
        stranger.settimeout(10.0)
        stranger.connect(server.address)
        reader = LineReader(stranger)
        for first in range(0, len(lines), 500):  # no more than the owner keeps for a slow reader
            some = lines[first : first + 500]
            stranger.sendall(b"".join(line + b"\n" for line in some))
            for line in some:
                answer = reader.read()
                assert answer is not None, line
                yield answer


@pytest.mark.parametrize(
    ("request_", "says"),
    [
        ('"request":"speed"', "rate is missing; rate is a whole number from 10 to 1000, or 0, or 65535"),
        ('"request":"speed","rate":"50"', "rate is '50'"),
        ('"request":"speed","rate":1e999', "rate is inf"),
        ('"request":"speed","rate":-1', "rate is -1"),
        ('"request":"speed","rate":true', "rate is True"),
        (f'"request":"speed","rate":{"9" * 4000}', "speed: rate is 9999"),
        ('"request":"speed","rat":50,"rate":50', "no field 'rat'; it has rate"),
        ('"request":"stop","by":"\\ud800"', "by is '\\ud800'"),
        ('"request":"stop","now":1', "now is 1; it must be true or false"),
        ('"request":"output","number":256,"value":0', "number is 256"),
        ('"request":"hello","token":"\\ud800"', "token is"),
        ('"request":"subscribe","topics":[["sample"]]', "topics is"),
        ('"request":["speed"]', "no request ['speed']"),
    ],
)
def test_a_malformed_request_is_answered_with_what_is_wrong(
    owner: tuple[Owner, PortClaim], request_: str, says: str
) -> None:
    client, server = owner
    for answer in answers(server, [b'{"id":7,%s}' % request_.encode()]):
        assert (answer["id"], answer["ok"]) == (7, False)
        assert says in f"{answer['error']}; {answer['hint']}"
    assert not client.told


@pytest.mark.parametrize("number", ["1e999", "[1]", '"\\ud800"', "1.5", "null"])
def test_an_id_that_cannot_be_repeated_is_refused(owner: tuple[Owner, PortClaim], number: str) -> None:
    (answer,) = answers(owner[1], [b'{"id":%s,"request":"stop"}' % number.encode()])
    assert (answer["id"], answer["ok"]) == (None, False)
    assert "without an id" in answer["error"]
    assert not owner[0].told


VALUES = (0, 1, -1, 10, 999, 1000, 65535, 65536, 10**30, 0.5, 1e999, -1e999, 1e300, True, None, "", "50")
VALUES += ("\ud800", "\x1b[2J", "x" * 201, [], {}, ["sample"], ["sample", 1], [[]], {"rate": 1}, "status")
NAMES = (*REQUESTS, "", "Speed", None, 3)
FIELDS = ("version", "token", "topics", "now", "by", "rate", "number", "value", "id", "x", "\ud800")


def random_request(numbers: random.Random) -> Message:
    """A request with any fields; about one in eight is one that the owner does."""
    name = numbers.choice(NAMES)
    fields = {field: numbers.choice(VALUES) for field in numbers.sample(FIELDS, numbers.randrange(3))}
    if name in REQUESTS and numbers.random() < 0.5:
        fields = {field: numbers.choice(VALUES) for field in REQUESTS[name]}
    return {"id": numbers.randrange(100), "request": name, **fields}


@pytest.mark.long
@pytest.mark.slow
def test_a_hundred_thousand_random_requests_are_answered(owner: tuple[Owner, PortClaim]) -> None:
    """All of them by the table, one in ten over a socket too."""
    seed = 26
    print("seed", seed)
    numbers = random.Random(seed)
    client, server = owner
    allowed, lines = 0, []
    for number in range(100_000):
        request = random_request(numbers)
        if number % 10 == 0:
            lines.append(json.dumps(request).replace("Infinity", "1e999").encode())
        with suppress(LinkError):  # anything else ends the test
            check(request, REQUESTS.get(request["request"], {}))
            allowed += 1
    done = 0
    for answer, line in zip(answers(server, lines), lines, strict=True):
        done += answer["ok"]
        assert answer["ok"] or (answer["error"] and answer["hint"]), line
    assert allowed > 5000
    assert done > 500
    for what, *values in client.told:
        fields = REQUESTS[str(what)].values()
        assert all(field.fits(value) for field, value in zip(fields, values, strict=False))


def test_an_output_of_an_arm_that_has_none_is_said_to_be_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Client, "info", SimpleNamespace(can=lambda feature: True))

    def refuse(what: str, *_: object, **__: object) -> None:
        raise refusal(what, wire.ERROR_CODES["unknown_command"])

    client = Client(cast(Any, SimpleNamespace(command=refuse)))
    with pytest.raises(BoardError, match=r"has no outputs; write a table \[output.NAME\]"):
        client.set_output(0, 1)
    assert client.levels() == Levels(0, ())
