"""Homing: by the switches, or by saying that the arm is at home, which is drawn and named first."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from nicegui import ui

from armtempo.model.home_switches import order
from armtempo.panel import words
from armtempo.panel.panel_board import Needs

if TYPE_CHECKING:
    from armtempo.panel.panel_page import PanelPage
    from armtempo.panel.press import Press


def ask(page: PanelPage, _: Press) -> None:
    """The dialog: the posture of home is drawn while it is open."""
    operator, arm = page.operator, page.operator.arm
    home_deg = np.array(arm.home_deg)
    page.show_ghost(home_deg)

    def chosen() -> str | None:
        return which.value or None

    def declare(press: Press) -> None:
        joint = chosen()
        page.do(press, words.HOME, lambda: operator.home(joint), Needs.COMMAND)

    def seek(press: Press) -> None:
        joint = chosen()
        asked.dialog.close()
        page.do(press, words.HOME_BY_SWITCHES, lambda: operator.home_to_switches(joint), Needs.COMMAND)

    def why_not() -> str:
        joint = chosen()
        fitted = joint is None or any(joint in group for group in groups)
        return "" if fitted else words.NO_SWITCH.format(joint=joint)

    def angles() -> str:
        shown = [
            f"{joint.name} {angle:g}{joint.unit.sign}"
            for joint, angle in zip(arm.driven, arm.home_deg, strict=True)
            if chosen() in (None, joint.name)
        ]
        return words.plain(", ".join(shown))

    asked = page.ask(words.SURE, words.HOME, declare, lambda: page.show_ghost(None))
    groups = order(arm)
    with asked.place:
        names = {"": words.ALL_JOINTS, **{joint.name: words.plain(joint.name) for joint in arm.driven}}
        which = ui.select(names, value="", label=words.WHICH_JOINTS).props("dense outlined")
        label = ui.label(angles()).classes("text-weight-bold")
        which.on_value_change(lambda: label.set_text(angles()))
        if groups:
            ui.label(words.BY_SWITCHES.format(order=words.plain(" → ".join(map(", ".join, groups)))))
            page.button(words.HOME_BY_SWITCHES, seek, Needs.COMMAND, why_not)
