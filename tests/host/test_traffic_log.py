"""The log of a link's traffic: written, read, replayed in place of a board."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from armtempo.basics.errors import InputError, LinkError
from armtempo.link import Client, traffic
from armtempo.link.session import Session
from armtempo_shared import wire

from tests.inprocess import Pipe
from tests.system.relay import ReplayTransport


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
    for line in ("1.0\t!\t00\t", "nan\t<\t00\t", "1e999\t<\t00\t", "1.0\t<\t0\t", "1.0\t<\t00"):
        path.write_text(f"{traffic.HEADER}\n{line}\n")
        with pytest.raises(InputError, match="line 2"):
            list(traffic.read_log(path))


def test_every_message_has_words() -> None:
    for entry in wire.COMMAND.values():
        payload = bytes(64) if entry[4] else bytes(len(wire.encode(entry, [0] * len(entry[3]))))
        assert entry[0] in traffic.describe(traffic.TO_BOARD, 1, entry[1], payload)
    assert "unknown" in traffic.describe(traffic.FROM_BOARD, 1, 0xEE, b"")
    assert "malformed" in traffic.describe(traffic.FROM_BOARD, 1, wire.EVENT["done"][1], b"x")


@pytest.mark.skipif(sys.platform != "linux", reason="the full disk of Linux, /dev/full")
def test_a_log_on_a_full_disk_is_cut_short_and_the_traffic_goes_on(tmp_path: Path) -> None:
    full = Path("/dev/full")
    pipe = Pipe(tmp_path / "flash")
    with pytest.raises(InputError, match="cut short: No space left"), traffic.LogFile(full) as log:  # noqa: PT012
        board = Client(Session(traffic.LoggedTransport(pipe, log), pipe.clock), 1)
        board.hello()
        board.status()
    with pytest.raises(InputError, match="cannot be written"):
        traffic.LogFile(tmp_path)
