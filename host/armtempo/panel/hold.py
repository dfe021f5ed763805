"""A motion that lasts while a browser reports that its button is held."""

from __future__ import annotations

import time
from collections.abc import Callable

from armtempo.panel import words
from armtempo.panel.panel_board import Needs, PanelBoard
from armtempo.panel.press import Press
from armtempo.robot.jog import HeldJog
from armtempo.robot.stop_request import Stopped

ALIVE_S = 0.35
"""A button counts as released this long after the browser's last report, which comes every 0.1 s."""
SHOWN_S = 0.4
"""A move to a target begins this long after its button was pressed: until then it is only shown."""
_STEP_S = 0.05


class ButtonHold:
    """The held button; at most one in the whole panel."""

    def __init__(self, operator: PanelBoard) -> None:
        self._operator = operator
        self._presses = operator.presses
        self._client = ""
        self._number = 0
        """Of the press that began the hold."""
        self._said_s = 0.0

    def press(
        self, client: str, press: Press, what: str, motion: Callable[[], HeldJog], after_s: float = 0.0
    ) -> None:
        """Begin a motion, ``after_s`` later if it is still held; raises InputError if it is not possible now."""
        said_s = self._presses.clock() - max(0.0, press.age_s(self._presses.clock()))

        def begin() -> None:
            self._client, self._number, self._said_s = client, press.number, said_s

        def work() -> None:
            try:
                self._move(client, press.number, motion(), said_s + after_s)
            finally:
                self.release(client, press.number)

        self._operator.do(what, client, press, work, Needs.MOVE, begin)

    def _move(self, client: str, number: int, planned: HeldJog, begin_s: float) -> None:
        """Move while it is held; raises Stopped, with the reason, if it ended before it was released."""
        live = self._operator.live
        while self.held(client, number) and self._presses.clock() < begin_s:
            time.sleep(_STEP_S / 5)
        if self.held(client, number):  # it may have been released meanwhile
            live.held = True
            try:
                with planned as jog:
                    while self.held(client, number) and jog.hold(_STEP_S):
                        live.angles_deg = jog.angles_deg
                    silent = self._is(client, number) and self._presses.clock() - self._said_s >= ALIVE_S
            finally:
                live.held = False
            if why := jog.ends or (
                words.BROWSER_SILENT if silent and client == self._operator.holder else ""
            ):
                raise Stopped(why)

    def alive(self, client: str, press: Press) -> None:
        """The browser reports that the button of its press ``press.number`` was held at that time."""
        if self._is(client, press.number):
            now_s = self._presses.clock()
            self._said_s = max(self._said_s, min(now_s, now_s - press.age_s(now_s)))

    def release(self, client: str, number: int) -> None:
        """The button of a press was released."""
        self._presses.released(client, number)
        if self._is(client, number):
            self._client = ""

    def lost(self, client: str) -> None:
        """The client has disconnected, or is connected again: it holds nothing any more."""
        if client == self._client:
            self._client = ""

    def held_by(self, client: str) -> bool:
        """Whether a client holds a button."""
        return client == self._client

    def held(self, client: str, number: int) -> bool:
        """Whether a client in control still holds the button of a press."""
        return (
            self._is(client, number)
            and client == self._operator.holder
            and self._presses.clock() - self._said_s < ALIVE_S
        )

    def _is(self, client: str, number: int) -> bool:
        return client == self._client and number == self._number
