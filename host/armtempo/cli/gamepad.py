"""A gamepad in addition to the keys of the terminal: a held stick repeats like a held key, its buttons are
keys.

A thread reads it with pygame. An unplugged gamepad counts as released.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from queue import Empty, SimpleQueue
from threading import Event, Thread
from types import MappingProxyType
from typing import Any

from armtempo.basics.errors import InputError, MissingPackageError
from armtempo.cli.keys import Keys

BUTTONS = MappingProxyType({0: "p", 1: " ", 2: "s", 3: "h", 6: "<", 7: ">"})
"""Keys by the numbers of buttons: A, B, X, Y, Back and Start of the usual layout."""
BEFORE, AFTER = 4, 5
"""The shoulder buttons: select the previous or the next joint or axis."""
REPEAT_S = 0.1
"""Repeat interval of a held direction: shorter than a terminal's, and than ``jog_screen.RELEASE_S``."""
PUSHED = 0.5
"""A stick counts as held from this deflection on (of 1)."""
HELP = """\
  gamepad: stick or cross  move    shoulder buttons  joint or axis    A  take a point (teach)    B  stop
           X  steps    Y  steps, or moving while held    Back, Start  slower, faster    keys still work"""
_AXES = ((0, 1), (1, -1))  # numbers of the left stick's axes, and the sign of right and up
_LOOK_S = 0.01
_POLL_S = 0.02
_START_S = 10.0


@dataclass
class GamepadState:
    """State of a gamepad, as keys."""

    joints: int
    """Number of the arm's joints."""
    held: str = ""
    """The key of the direction that is held, + or -; "" for none."""
    pressed: SimpleQueue[str] = field(default_factory=SimpleQueue)
    _at: int = 0
    _repeated_s: float = 0.0

    def button(self, number: int) -> None:
        """A button was pressed."""
        if number in (BEFORE, AFTER):
            choices = [*map(str, range(1, self.joints + 1)), *"xyzXYZ"]
            self._at = (self._at + (1 if number == AFTER else -1)) % len(choices)
            self.pressed.put(choices[self._at])
        elif number in BUTTONS:
            self.pressed.put(BUTTONS[number])

    def directions(self, sticks: list[float], cross: tuple[int, int]) -> None:
        """Note the positions of the left stick (-1 to 1, right and up positive) and of the cross."""
        pushed = max([*sticks, *map(float, cross)], key=abs)
        self.held = "" if abs(pushed) < PUSHED else "+" if pushed > 0 else "-"

    def take(self, now_s: float) -> str:
        """The next key, "" for none."""
        try:
            return self.pressed.get_nowait()
        except Empty:
            pass
        if not self.held or now_s - self._repeated_s < REPEAT_S:
            return ""
        self._repeated_s = now_s
        return self.held

    def flush(self) -> None:
        """Forget buttons that were pressed."""
        while not self.pressed.empty():
            self.pressed.get_nowait()


class KeysAndGamepad:
    """Keys of a terminal and of a gamepad, in the order in which they are pressed."""

    def __init__(self, keys: Keys, gamepad: GamepadState) -> None:
        self._keys = keys
        self._gamepad = gamepad

    def read(self, timeout_s: float) -> str:
        until_s = time.monotonic() + timeout_s
        while True:
            now_s = time.monotonic()
            key = self._gamepad.take(now_s) or self._keys.read(max(0.0, min(_POLL_S, until_s - now_s)))
            if key or time.monotonic() >= until_s:
                return key

    def flush(self) -> None:
        self._gamepad.flush()
        self._keys.flush()


@contextmanager
def added_to(keys: Keys, joints: int) -> Iterator[Keys]:
    """``keys`` together with the first connected gamepad, for an arm of ``joints`` joints.

    Raises MissingPackageError without pygame, InputError if there is no gamepad.
    """
    pygame = _pygame()
    state = GamepadState(joints)
    ready, done = Event(), Event()
    found: list[str] = []
    thread = Thread(target=_follow, args=(pygame, state, found.append, ready, done), daemon=True)
    thread.start()
    try:
        ready.wait(_START_S)
        if not found:
            raise InputError(
                "no gamepad is connected", "connect one, or leave out --gamepad and use the keys"
            )
        yield KeysAndGamepad(keys, state)
    finally:
        done.set()
        thread.join(_START_S)


def _pygame() -> Any:
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
    os.environ.setdefault("SDL_VIDEODRIVER", "dummy")  # neither a window nor a display is needed
    os.environ.setdefault("SDL_JOYSTICK_ALLOW_BACKGROUND_EVENTS", "1")
    try:
        import pygame
    except ImportError:
        raise MissingPackageError("reading a gamepad", "pygame-ce", "gamepad") from None
    return pygame


def _follow(
    pygame: Any, state: GamepadState, found: Callable[[str], None], ready: Event, done: Event
) -> None:
    """The thread: update ``state`` from the gamepad until ``done``."""
    try:
        pygame.display.init()  # pygame's events need it
        pygame.joystick.init()
        if not pygame.joystick.get_count():
            return
        pad = pygame.joystick.Joystick(0)
        found(pad.get_name())
        ready.set()
        while not done.wait(_LOOK_S) and _look(pygame, pad, state):
            pass
    finally:
        state.held = ""
        ready.set()
        pygame.quit()


def _look(pygame: Any, pad: Any, state: GamepadState) -> bool:
    """Update ``state``; False if the gamepad is disconnected."""
    for event in pygame.event.get():
        if event.type == pygame.JOYDEVICEREMOVED:
            return False
        if event.type == pygame.JOYBUTTONDOWN:
            state.button(event.button)
    cross = pad.get_hat(0) if pad.get_numhats() else (0, 0)
    state.directions([sign * pad.get_axis(axis) for axis, sign in _AXES if axis < pad.get_numaxes()], cross)
    return True
