"""What is run once: in the board's memory, or stored for a moment if it is larger."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from armtempo.basics.errors import LinkError
from armtempo.encoding.encoded_plan import MotionKey
from armtempo.robot.running import on_board
from armtempo_shared import wire
from armtempo_shared.messages import ONCE_NAME

MOST = 64


class Board:
    """What a board has of motions."""

    def __init__(self) -> None:
        self.info = SimpleNamespace(once_bytes=MOST)
        self.stored: dict[str, bytes] = {}
        self.kept = b""

    def put_once(self, data: bytes) -> int:
        assert len(data) <= MOST
        self.kept = data
        return wire.record_crc(data)

    def upload(self, name: str, data: bytes) -> None:
        self.stored[name] = data

    def remove(self, name: str) -> None:
        del self.stored[name]
        raise LinkError("the answer is lost")


@pytest.mark.parametrize("size", [40, MOST, MOST + 1, 1000])
def test_a_move_of_any_size_can_be_run_once(size: int) -> None:
    board: Any = Board()
    data = bytes(size)
    with on_board(board, data) as key:
        kept = {ONCE_NAME: board.kept} if size <= MOST else board.stored
        assert {key: data} == {MotionKey(name, wire.record_crc(one)): one for name, one in kept.items()}
    assert board.stored == {}
