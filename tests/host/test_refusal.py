"""What the host says when the board refuses: what is wrong, of which joint, what the number is, what to do."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from armtempo.errors import BoardError
from armtempo.link.refusal import refusal
from armtempo_shared import wire
from armtempo_shared.limits import MAX_MOTION_BYTES
from armtempo_shared.meanings import VALUES

from tests.host.linked import ready
from tests.inprocess import Pipe


@pytest.mark.parametrize("name", VALUES)
def test_every_number_is_said_with_what_it_is(name: str) -> None:
    code = wire.ERROR_CODES[name]
    _, meaning, cure = wire.ERRORS[code]
    error = refusal("no", code, 1, 4711)
    assert error.code == code
    text = str(error)
    assert text.startswith(f"no: {meaning} (joint 2) [")
    assert text.endswith(f" 4711]; {cure}")
    assert "[4711]" not in text


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
