"""One browser's page: what its tabs share, and when each of its controls can be used."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from nicegui import ui
from nicegui.element import Element

from armtempo.basics.arrays import Array
from armtempo.basics.errors import ArmtempoError
from armtempo.panel.arm_scene import ArmScene, ArmShape
from armtempo.panel.held_jog import ButtonHold, JogButton
from armtempo.panel.operator import Operator

LOOK_S = 0.25
"""Interval at which a page looks at what has changed, but for what moves."""


@dataclass
class PanelPage:
    """One browser's page: what its tabs share."""

    operator: Operator
    hold: ButtonHold
    shape: ArmShape
    client: str
    controls: list[tuple[Element, bool]] = field(default_factory=list)
    """What can be pressed, and whether that moves the arm."""
    listeners: list[Callable[[], None]] = field(default_factory=list)
    """Called every LOOK_S: each tab looks at what has changed."""
    buttons: list[JogButton] = field(default_factory=list)
    jog_percent: float = 25.0
    scene: ArmScene = field(init=False)
    _reasons: tuple[str, str] = ("-", "-")

    def control(self, element: Element, moves: bool = True) -> Any:
        """An element that is greyed, with the reason as its hint, while it cannot be used."""
        with element:
            ui.tooltip("").classes("text-sm")
        self.controls.append((element, moves))
        return element

    def do(self, what: str, call: Callable[[], object], moves: bool = True) -> None:
        """Let the operator begin a command; what is refused is said."""
        self.attempt(lambda: self.operator.do(what, self.client, call, moves))

    def attempt(self, call: Callable[[], object]) -> None:
        """Do something at once; an error is said in the words of the library."""
        try:
            call()
        except ArmtempoError as error:
            ui.notify(str(error), type="negative", multi_line=True, timeout=8000)

    def show_ghost(self, angles_deg: Array) -> None:
        """Show where the arm would be at these angles, (J,), besides where it is; on this page only."""
        poses = json.dumps(self.shape.poses(angles_deg))
        ui.run_javascript(f"armtempo.ghost = {poses}")

    def refresh(self) -> None:
        """Grey what cannot be used now, with the reason."""
        operator = self.operator
        reasons = operator.why_not(self.client), operator.why_not(self.client, moves=False)
        if reasons != self._reasons:
            self._reasons = reasons
            for element, moves in self.controls:
                reason = reasons[0] if moves else reasons[1]
                element.set_enabled(not reason)  # type: ignore[attr-defined]
                for hint in element.default_slot.children:
                    if isinstance(hint, ui.tooltip):
                        hint.set_text(reason or element.props.get("aria-label", ""))
                        hint.set_visibility(bool(reason))
        for listener in self.listeners:
            listener()
