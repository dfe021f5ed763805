"""Who has a port: the file that says so, the socket behind it, and what a caller hears."""

from __future__ import annotations

import os
import socket
import stat
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from armtempo.basics.errors import BoardError, LinkError, NoAnswerError, PortError
from armtempo.link.turns import Turns
from armtempo.ports import caller, claim
from armtempo.ports.caller import Caller, Ownership, ownership
from armtempo.ports.lines import Message
from armtempo.ports.server import Server
from armtempo.robot.shared_board import SharedBoard


def handle(request: Message) -> Message:
    """Answers as a board's owner might."""
    if request.get("refuse"):
        raise BoardError("refused", "ask again", 7)
    return {"echo": request.get("text")}


@pytest.fixture
def server() -> Iterator[Server]:
    found = Server(claim.new("/dev/p", "/dev/p", "/dev/p"), {"echo": handle})
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
    server = Server(claim.new("COM5", "COM5", "COM5"), {"echo": handle})
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
    assert ownership(server.claim) is Ownership.LIVES
    server.close()
    assert ownership(server.claim) is Ownership.DIED
    monkeypatch.setattr(caller, "HANGS_S", 0.1)
    deaf = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    with deaf:
        deaf.bind(server.claim.address)
        deaf.listen()
        assert ownership(server.claim) is Ownership.HANGS
        with pytest.raises(NoAnswerError, match="does not answer"):
            Caller(server.claim)
    Path(server.claim.address).unlink()


def test_that_a_program_hangs_is_remembered_for_a_while(monkeypatch: pytest.MonkeyPatch) -> None:
    gone = claim.new("/dev/p", "/dev/p", "/dev/p")
    assert ownership(gone) is Ownership.DIED
    caller.remember_hanging(gone.number)
    assert ownership(gone) is Ownership.HANGS  # it was not asked
    monkeypatch.setattr(caller, "_REMEMBERED_S", 0.0)
    assert ownership(gone) is Ownership.DIED


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
        with pytest.raises(LinkError, match="topics must be"):
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
    turns, order, ended = Turns(), [], threading.Event()

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
