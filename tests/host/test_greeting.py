"""What the host's first bytes may do to a board that is just starting, whose prompt still listens."""

from __future__ import annotations

from pathlib import Path

from armtempo.link import Client
from armtempo.link.client import harmless_number
from armtempo.link.session import Session
from armtempo_shared import wire

from tests.inprocess import Pipe


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
