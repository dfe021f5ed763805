"""The screen of armtempo jog: its keys, its line, and what ends a step."""

from __future__ import annotations

import sys
from collections import deque
from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest
from armtempo.basics.errors import InputError
from armtempo.cli.jog_screen import JogChoice, JogScreen, _StopKeys
from armtempo.cli.keys import INTERRUPT, WindowsKeys
from armtempo.model.arm import Arm
from armtempo.model.frame import ArmFrame

NAMES = ["waist", "shoulder"]


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ("", "waist, step 1°, 25 %"),
        ("2", "shoulder, step 1°, 25 %"),
        ("3", "waist, step 1°, 25 %"),  # there is no third joint
        ("s", "waist, step 10°, 25 %"),
        ("ss", "waist, step 0.1°, 25 %"),
        ("h", "waist, held, 25 %"),
        ("hs", "waist, step 10°, 25 %"),
        ("y", "tool along y, step 1 mm, 25 %"),
        ("Zf", "tool about tool's z, step 1°, 25 %"),
        ("z1", "waist, step 1°, 25 %"),
        (">", "waist, step 1°, 50 %"),
        (">" * 9, "waist, step 1°, 100 %"),
        ("<" * 9, "waist, step 1°, 1 %"),
    ],
)
def test_keys_choose_what_moves(keys: str, said: str) -> None:
    choice = JogChoice()
    for key in keys:
        assert choice.press(key, len(NAMES)) is (key != "3")
    assert choice.describe(NAMES) == said
    assert not choice.press("+", len(NAMES))


def test_the_axis_has_the_librarys_name() -> None:
    choice = JogChoice()
    assert choice.tool_axis is None
    choice.press("Y", 2)
    assert choice.tool_axis == "y"
    choice.press("f", 2)
    assert choice.tool_axis == "tool-y"
    choice.press("f", 2)
    assert choice.tool_axis == "y"
    with pytest.raises(InputError, match="no frame 'toll'; did you mean 'tool'"):
        choice.choose("toll")


def test_the_frames_of_the_arm_are_among_those_to_choose_from() -> None:
    here = tuple(map(tuple, np.eye(4).tolist()))
    board = Jogged()
    board.arm = replace(board.arm, frames=(ArmFrame("tray", here),))
    choice = JogScreen(cast(Any, board), Typed()).choice
    choice.press("z", 3)
    named = []
    for _ in range(4):
        named.append(choice.tool_axis)
        choice.press("f", 3)
    assert named == ["z", "tool-z", "tray-z", "z"]
    choice.press("f", 3)
    assert choice.describe(NAMES) == "tool along tray's z, step 1 mm, 25 %"


class Typed:
    """Keys that were pressed already; then none."""

    def __init__(self, *keys: str) -> None:
        self._keys = deque(keys)

    def read(self, _seconds: float) -> str:
        return self._keys.popleft() if self._keys else ""

    def flush(self) -> None:
        self._keys.clear()


class Jogged:
    """A board that notes what is to move."""

    arm = Arm.paper()
    last_jog_ends = "joint 1 is at the end of its range, 190 degrees"

    def __init__(self) -> None:
        self.moves: list[tuple[object, ...]] = []

    def posture_deg(self) -> np.ndarray:
        return np.array(self.arm.home_deg)

    def jog(self, *move: object) -> None:
        """The last of it is the wish to stop."""
        self.moves.append(move[:-1])


@pytest.mark.parametrize("arm", ["paper", "ar4"])
def test_the_line_never_wraps_in_80_columns(
    arm: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(Jogged, "arm", Arm.load(arm))
    monkeypatch.setenv("COLUMNS", "80")
    screen = JogScreen(Jogged(), Typed())  # type: ignore[arg-type]
    for key in ("", "Z", "+", "%", "2", "-"):
        screen._act(key)
        screen._show()
    lines = [line.removeprefix("\x1b[K") for line in capsys.readouterr().out.split("\r")[1:]]
    assert max(map(len, lines)) <= 79
    assert any("at the end of its range" in line for line in lines)
    assert any(line.endswith("°") and "mm" in line for line in lines)


def test_a_question_mark_says_the_keys(capsys: pytest.CaptureFixture[str]) -> None:
    screen = JogScreen(Jogged(), Typed(), {"p": str}, "  p  the caller's")  # type: ignore[arg-type]
    screen._act("?")
    said = capsys.readouterr().out
    assert "steps, or moving while" in said
    assert said.endswith("the caller's\n")


def test_a_step_goes_to_the_board_as_it_was_chosen() -> None:
    board = Jogged()
    screen = JogScreen(board, Typed())  # type: ignore[arg-type]
    for key in "+>2s-zf+":
        screen._act(key)
    assert board.moves == [
        (1, 1.0, None, None, 0.25),
        (2, -10.0, None, None, 0.5),
        (None, None, "tool-z", 10.0, 0.5),
    ]


@pytest.mark.parametrize("key", [" ", "q"])
def test_space_and_what_ends_the_screen_end_a_step(key: str) -> None:
    with _StopKeys(Typed("x", key)) as stop:  # type: ignore[arg-type]
        stop._thread.join(10.0)
    assert stop.request.wanted
    assert stop.pressed == key


class Console:
    """Python's ``msvcrt`` with keys that were pressed."""

    def __init__(self, *codes: str) -> None:
        self._codes = deque(codes)

    def kbhit(self) -> bool:
        return bool(self._codes)

    def getwch(self) -> str:
        return self._codes.popleft()


def test_keys_of_a_windows_console(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "msvcrt", Console("\xe0", "H", "\x00", "K", "\xe0", "?", "a", "\x03"))
    keys = WindowsKeys()
    assert [keys.read(0.0) for _ in range(6)] == ["up", "left", "", "a", INTERRUPT, ""]


def test_other_keys_end_no_step() -> None:
    with _StopKeys(Typed("x", "s")) as stop:  # type: ignore[arg-type]
        pass
    assert not stop.request.wanted
    assert not stop._thread.is_alive()
