"""A jog that lasts as long as a browser says that its button is held."""

from __future__ import annotations

import time
from dataclasses import dataclass

from armtempo.panel.operator import Operator

ALIVE_S = 0.35
"""A button counts as released if the browser has not said for this long that it is held; it says so every 0.1 s."""
_STEP_S = 0.05


@dataclass(frozen=True)
class JogButton:
    """What a button moves: a joint (from 1), or the tool along or about an axis."""

    joint: int | None = None
    axis: str | None = None
    turn: bool = False
    direction: int = 1


class ButtonHold:
    """The button that a client holds; at most one in the whole panel."""

    def __init__(self, operator: Operator) -> None:
        self._operator = operator
        self._client = ""
        self._said_s = 0.0

    def press(self, client: str, button: JogButton, speed: float) -> None:
        """Begin; InputError if it cannot be now. ``speed``: part of the limits, 0.01 to 1."""
        self._client, self._said_s = client, time.monotonic()
        self._operator.do("jog", client, lambda: self._jog(client, button, speed))

    def alive(self, client: str) -> None:
        """The browser says that the button is still held."""
        if client == self._client:
            self._said_s = time.monotonic()

    def release(self, client: str) -> None:
        """The button was released, or the client has gone."""
        if client == self._client:
            self._client = ""

    def _held(self, client: str) -> bool:
        return client == self._client == self._operator.holder and time.monotonic() - self._said_s < ALIVE_S

    def _jog(self, client: str, button: JogButton, speed: float) -> None:
        board = self._operator.board
        with board.held_jog(button.joint, button.axis, button.direction, button.turn, speed) as jog:
            while self._held(client) and jog.hold(_STEP_S):
                self._operator.angles_deg = jog.angles_deg
