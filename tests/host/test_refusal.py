"""What the host says when the board refuses: what is wrong, of which joint, what the number is, what to do."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from armtempo.basics.errors import BoardError
from armtempo.link.refusal import refusal
from armtempo_shared import wire
from armtempo_shared.limits import MAX_MOTION_BYTES
from armtempo_shared.meanings import VALUES

from tests.host.linked import ready
from tests.inprocess import Pipe

SAID = {
    "protocol": "no: host and board speak different protocol versions (joint 2) [version of the board: 4711]; "
    "run 'armtempo deploy'",
    "fault_pending": "no: a fault is pending (joint 2) [code of the fault: 4711]; remove its cause, then "
    "'armtempo clear'",
    "flash_full": "no: the flash is full; stored motions are kept (joint 2) [bytes free: 4711]; "
    "remove motions that are no longer needed: 'armtempo remove'",
    "bad_offset": "no: a piece of the upload is out of order (joint 2) [bytes received so far: 4711]; "
    "upload it again",
    "wrong_joints": "no: the motion and the arm differ in the number of joints (joint 2) [joints of the motion: "
    "4711]; plan it for this arm",
    "time_order": "no: the time control points do not increase (joint 2) [number of the control point: 4711]; "
    "plan it again",
    "out_of_range": "no: the motion leaves the joint's range (joint 2) [position in steps: 4711]; check the via "
    "points or the range",
    "wrong_start": "no: the arm is not at the start of the motion (joint 2) [steps from there to the start: "
    "4711]; move it there: 'armtempo goto' with the motion's name or file",
    "too_long": "no: the motion is longer or larger than the board can hold (joint 2) [its numbers reach 4711]; "
    "lower refine, use shared timing or fewer via points, or split it",
    "no_room": "no: the engine for this arm does not fit into the board's memory; nothing was changed (joint 2) "
    "[bytes needed: 4711]; lower its top speeds, drive fewer joints, or put the program into the firmware "
    "('armtempo flash')",
    "pin_taken": "no: an output or input of the arm uses a pin or timer that is already in use (joint 2) [PE9: "
    "encoder 1]; give "
    "another pin ('armtempo check' names the arm file's key; 'armtempo help hardware' lists what is free)",
    "leg_missing": "no: a motion of the sequence is missing on the board, or differs from the planned one "
    "(joint 2) [number of the motion in the sequence, from 1: 4711]; upload the sequence again, which uploads its "
    "motions too",
    "leg_elsewhere": "no: a motion of the sequence does not begin where the previous one ends (joint 2) [number of "
    "the step in the sequence: 4711]; plan the sequence again and upload it",
    "no_such_pin": "no: the sequence uses an output or an input that the arm on the board does not have (joint 2) "
    "[number of the step in the sequence: 4711]; plan the sequence again with the arm file that the board is set up "
    "for",
    "no_sequence_room": "no: the board has no room to run a sequence of motions for this arm; nothing has moved "
    "(joint 2) [bytes that are missing: 4711]; put the program into the firmware ('armtempo flash'), or "
    "let the host run the steps (board.run)",
    "too_abrupt": "no: the motion reverses too fast for the step generator (joint 2) [steps/s²: 4711]; lower the "
    "limits",
}


@pytest.mark.parametrize("name", SAID)
def test_every_number_is_said_with_what_it_is(name: str) -> None:
    error = refusal("no", wire.ERROR_CODES[name], 1, 0x49 if name == "pin_taken" else 4711)
    assert error.code == wire.ERROR_CODES[name]
    assert str(error) == SAID[name]


def test_a_pin_is_named_with_what_can_hold_it() -> None:
    code = wire.ERROR_CODES["pin_taken"]
    assert "[PA0: the button, STEP of channel 6]" in str(refusal("no", code))
    assert "[PE12: ENABLE of the drivers]" in str(refusal("no", code, value=0x4C))
    assert "[PD0: it, or its timer, has another output or input already]" in str(
        refusal("no", code, value=0x30)
    )


def test_every_code_with_a_number_is_tried() -> None:
    assert set(SAID) | {"too_fast"} == set(VALUES)
    error = str(refusal("no", wire.ERROR_CODES["too_fast"], 1, 4711))
    assert re.fullmatch(
        r"no: .* \(joint 2\) \[steps/s needed: 4711\]; plan it again with this arm file.*", error
    ), error


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
