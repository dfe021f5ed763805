"""A browser's page: common parts of its tabs, and when each of its controls can be used."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, TypeVar

from nicegui import run, ui
from nicegui.element import Element

from armtempo.basics.arrays import Array
from armtempo.basics.errors import ArmtempoError, InputError
from armtempo.panel import words
from armtempo.panel.arm_scene import ArmScene, ArmShape
from armtempo.panel.held_jog import ButtonHold
from armtempo.panel.operator import Needs, Operator
from armtempo.planning.jog.jog_motion import JogMove
from armtempo.robot.board import Board

T = TypeVar("T")
LOOK_S = 0.25
"""Interval at which a page updates, except for moving parts."""


@dataclass
class _Control:
    """A control of the page, and its requirements."""

    element: Element
    why_not: Callable[[], str]
    is_held: bool
    """Whether it acts while it is held."""
    reason: str = "-"
    """Why it cannot be pressed."""

    def grey(self, reason: str) -> None:
        """Disable it, with the reason as its hint, unless that is \"\"."""
        if reason == self.reason:
            return
        self.reason = reason
        self.element.set_enabled(not reason)  # type: ignore[attr-defined]
        for hint in self.element.default_slot.children:
            if isinstance(hint, ui.tooltip):
                hint.set_text(reason)
                hint.set_visibility(bool(reason))


@dataclass
class PanelPage:
    """A browser's page: common parts of its tabs."""

    operator: Operator
    hold: ButtonHold
    shape: ArmShape
    client: str
    controls: list[_Control] = field(default_factory=list)
    """The controls that need something."""
    shown: str = ""
    """The tab that is shown."""
    listeners: list[tuple[str, Callable[[], None]]] = field(default_factory=list)
    """Called every LOOK_S while their tab is shown; without a tab, always."""
    jogs: list[JogMove] = field(default_factory=list)
    """Moves of the hold buttons, by number."""
    jog_percent: float = 25.0
    picture: Element = field(init=False)
    """The place of the scene."""

    @cached_property
    def scene(self) -> ArmScene:
        """The arm in 3-D, made when it is first needed, so that the first view does not wait for it."""
        with self.picture:
            scene = ArmScene(self.shape)
            ui.run_javascript(f"armtempo.show({scene.parts})")
        return scene

    def control(
        self,
        element: Element,
        needs: Needs | None = Needs.MOVE,
        more: Callable[[], str] = str,
        is_held: bool = False,
    ) -> Any:
        """An element that is disabled, with the reason as its hint, while it cannot be used.

        ``needs``: None if a page without control can use it too. ``more``: a further reason, "" if there is none.
        """
        with element:
            ui.tooltip("")

        def why_not() -> str:
            return (self.operator.why_not(self.client, needs) if needs is not None else "") or more()

        control = _Control(element, why_not, is_held)
        control.grey(control.why_not())
        self.controls.append(control)
        return element

    def on_look(self, listener: Callable[[], None]) -> None:
        """Call ``listener`` every LOOK_S while the tab that is being built is shown."""
        self.listeners.append((self.shown, listener))

    def do(self, what: str, call: Callable[[], object], needs: Needs = Needs.MOVE) -> None:
        """Start a command of the operator; show a refusal."""
        self.attempt(lambda: self.operator.do(what, self.client, call, needs))

    def attempt(self, call: Callable[[], object]) -> bool:
        """Call something; show the library's error and return False if it fails."""
        try:
            call()
            return True
        except ArmtempoError as error:
            _say(error)
            return False

    def check(self, needs: Needs) -> None:
        """Raise InputError, with the reason, if the requirements are not met."""
        if reason := self.operator.why_not(self.client, needs):
            raise InputError(reason, words.WAIT)

    async def at_once(self, call: Callable[[Board], object], needs: Needs = Needs.BOARD) -> None:
        """Call something on the board at once, also during a command."""
        if self.attempt(lambda: self.check(needs)):
            await self.threaded(lambda: call(self.operator.board))

    async def threaded(self, call: Callable[[], T]) -> T | None:
        """Run ``call`` in a thread, so that no page waits; show an error."""
        try:
            return await run.io_bound(call)
        except ArmtempoError as error:
            _say(error)
            return None

    def show_ghost(self, angles_deg: Array) -> None:
        """Show a ghost of the arm at these angles, (J,), on this page only."""
        poses = json.dumps(self.shape.poses(angles_deg))
        ui.run_javascript(f"armtempo.ghost = {poses}")

    def refresh(self) -> None:
        """Disable controls that cannot be used now, with the reason."""
        self.controls = [control for control in self.controls if not control.element.is_deleted]
        for control in self.controls:
            # a held button keeps the keyboard's focus
            if not (control.is_held and self.hold.held_by(self.client)):
                control.grey(control.why_not())
        for tab, listener in self.listeners:
            if tab in ("", self.shown):
                listener()


def _say(error: ArmtempoError) -> None:
    """Show an error on this page."""
    ui.notify(str(error), type="negative", multi_line=True, timeout=8000)
