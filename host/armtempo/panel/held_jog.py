"""A jog that lasts while a browser reports that its button is held."""

from __future__ import annotations

import math
import time

from armtempo.panel.operator import Operator
from armtempo.planning.jog.jog_motion import JogMove

ALIVE_S = 0.35
"""A button counts as released after this time without a report of the browser, which comes every 0.1 s."""
_STEP_S = 0.05


class ButtonHold:
    """The held button; at most one in the whole panel."""

    def __init__(self, operator: Operator) -> None:
        self._operator = operator
        self._client = ""
        self._said_s = 0.0

    def press(self, client: str, move: JogMove, speed: float) -> None:
        """Begin a jog; raises InputError if it is not possible now. ``speed``: fraction of the limits, 0.01 to 1."""
        self._client, self._said_s = client, time.monotonic()
        self._operator.do("jog", client, lambda: self._jog(client, move, speed))

    def alive(self, client: str) -> None:
        """The browser reports that the button is still held."""
        if client == self._client:
            self._said_s = time.monotonic()

    def release(self, client: str) -> None:
        """The button was released, or the client has disconnected."""
        if client == self._client:
            self._client = ""

    def held_by(self, client: str) -> bool:
        """Whether a client holds the button."""
        return client == self._client

    def _held(self, client: str) -> bool:
        return (
            self.held_by(client)
            and client == self._operator.holder
            and time.monotonic() - self._said_s < ALIVE_S
        )

    def _jog(self, client: str, move: JogMove, speed: float) -> None:
        joint = None if move.joint is None else move.joint + 1
        way = int(math.copysign(1, move.by))
        with self._operator.board.held_jog(joint, move.axis or None, way, move.about, speed) as jog:
            while self._held(client) and jog.hold(_STEP_S):
                self._operator.live.angles_deg = jog.angles_deg
