"""A gamepad as keys: buttons, what is held, unplugged; with a pygame that stands in, and without any."""

from __future__ import annotations

import itertools
import os
import sys
import time
from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

import pytest
from armtempo.basics.errors import InputError, MissingPackageError
from armtempo.cli import gamepad
from armtempo.cli.gamepad import AFTER, BEFORE, REPEAT_S, GamepadState, KeysAndGamepad
from armtempo.cli.jog_screen import RELEASE_S, JogChoice

DOWN, REMOVED = 1, 2
LIMIT_S = 20.0


class NoKeys:
    """A terminal at which nobody presses a key."""

    def read(self, timeout_s: float) -> str:
        """None comes."""
        time.sleep(timeout_s)
        return ""

    def flush(self) -> None:
        """There are none."""


class Pad:
    """What pygame calls a joystick."""

    def __init__(self) -> None:
        self.axes = [0.0, 0.0]
        self.hat = (0, 0)

    def get_name(self) -> str:
        return "pad"

    def get_numhats(self) -> int:
        return 1

    def get_hat(self, number: int) -> tuple[int, int]:
        return self.hat

    def get_numaxes(self) -> int:
        return len(self.axes)

    def get_axis(self, number: int) -> float:
        return self.axes[number]


class Pygame:
    """What the gamepad needs of pygame."""

    JOYBUTTONDOWN, JOYDEVICEREMOVED = DOWN, REMOVED

    def __init__(self, pads: int = 1) -> None:
        self.pad = Pad()
        self.events: list[Any] = []
        self.ended = False
        self.display = SimpleNamespace(init=lambda: None)
        self.joystick = SimpleNamespace(
            init=lambda: None, get_count=lambda: pads, Joystick=lambda number: self.pad
        )
        self.event = SimpleNamespace(get=self._get)

    def _get(self) -> list[Any]:
        found, self.events = self.events, []
        return found

    def quit(self) -> None:
        self.ended = True


def test_buttons_are_keys_of_the_jog_screen() -> None:
    state = GamepadState(joints=2)
    for number in (*gamepad.BUTTONS, 40):
        state.button(number)
    keys = []
    while key := state.take(0.0):
        keys.append(key)
    assert keys == list(gamepad.BUTTONS.values())
    choice = JogChoice()
    assert all(choice.press(key, 2) for key in keys if key not in "p ")


def test_the_shoulder_buttons_go_round_joints_and_axes() -> None:
    state = GamepadState(joints=2)
    for number in (AFTER, AFTER, BEFORE, BEFORE, BEFORE, AFTER):
        state.button(number)
    assert [state.take(0.0) for _ in range(6)] == ["2", "x", "2", "1", "Z", "1"]


@pytest.mark.parametrize(
    ("sticks", "cross", "held"),
    [
        ([0.0, 0.0], (0, 0), ""),
        ([0.4, -0.49], (0, 0), ""),
        ([0.6, 0.0], (0, 0), "+"),
        ([0.1, -1.0], (0, 0), "-"),
        ([0.0, 0.0], (0, 1), "+"),
        ([], (-1, 0), "-"),
    ],
)
def test_what_is_held(sticks: list[float], cross: tuple[int, int], held: str) -> None:
    state = GamepadState(joints=3)
    state.directions(sticks, cross)
    assert state.held == held


def test_what_is_held_repeats_often_enough_to_count_as_held() -> None:
    state = GamepadState(joints=3, held="+")
    times = [number / 100 for number in range(100, 200)]
    came = [now_s for now_s in times if state.take(now_s)]
    gaps = [later - before for before, later in itertools.pairwise(came)]
    assert min(gaps) >= REPEAT_S
    assert max(gaps) < RELEASE_S / 2
    state.held = ""
    assert not state.take(9.0)


def test_flushed_buttons_are_forgotten() -> None:
    state = GamepadState(joints=3)
    state.button(1)
    KeysAndGamepad(NoKeys(), state).flush()
    assert not state.take(0.0)


def test_it_is_followed_until_it_is_unplugged(monkeypatch: pytest.MonkeyPatch) -> None:
    pygame = Pygame()
    monkeypatch.setitem(sys.modules, "pygame", pygame)
    with gamepad.added_to(NoKeys(), joints=3) as keys:
        assert keys.read(0.0) == ""
        pygame.pad.axes = [0.0, -1.0]  # pushed away from the body
        assert keys.read(LIMIT_S) == "+"
        pygame.pad.axes = [0.0, 0.0]
        pygame.events = [SimpleNamespace(type=DOWN, button=1)]
        while (key := keys.read(LIMIT_S)) == "+":
            pass
        assert key == " "
        pygame.pad.hat = (-1, 0)
        assert keys.read(LIMIT_S) == "-"
        pygame.events = [SimpleNamespace(type=REMOVED)]
        limit_s = time.monotonic() + LIMIT_S
        while not pygame.ended:
            assert time.monotonic() < limit_s
            time.sleep(0.01)
        assert keys.read(3 * REPEAT_S) == ""


def test_none_is_connected(monkeypatch: pytest.MonkeyPatch) -> None:
    pygame = Pygame(pads=0)
    monkeypatch.setitem(sys.modules, "pygame", pygame)
    with pytest.raises(InputError, match="no gamepad is connected"), gamepad.added_to(NoKeys(), 3):
        pass
    assert pygame.ended


def test_pygame_opens_no_window_and_reads_beside_other_programs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pygame", Pygame(pads=0))
    with patch.dict(os.environ):
        for name in [name for name in os.environ if name.startswith(("SDL_", "PYGAME_"))]:
            del os.environ[name]
        with pytest.raises(InputError), gamepad.added_to(NoKeys(), 3):
            pass
        assert os.environ["SDL_VIDEODRIVER"] == "dummy"
        assert os.environ["SDL_JOYSTICK_ALLOW_BACKGROUND_EVENTS"] == "1"
        assert os.environ["PYGAME_HIDE_SUPPORT_PROMPT"] == "1"


def test_without_pygame_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pygame", None)
    with pytest.raises(MissingPackageError, match=r"gamepad") as caught, gamepad.added_to(NoKeys(), 3):
        pass
    assert "pygame-ce" in (caught.value.hint or "")
