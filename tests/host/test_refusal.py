"""What the host says if the board refuses: the cause, the joint, the number, what to do."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from armtempo.basics.errors import BoardError
from armtempo.link.refusal import refusal
from armtempo_shared import wire
from armtempo_shared.limits import MAX_MOTION_BYTES
from armtempo_shared.meanings import VALUES

from tests.inprocess import Pipe, ready

NUMBERS = sorted(VALUES.keys() - {"too_fast", "too_long", "pin_taken"})
"""Names of codes whose number is said as the table of meanings has it."""


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
