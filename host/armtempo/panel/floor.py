"""The height of the table, asked for where the arm file names no workspace: a jog would go below it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import tomlkit
from nicegui import ui

from armtempo.basics import toml_table
from armtempo.basics.atomic_file import replace_text
from armtempo.basics.errors import InputError
from armtempo.model.arm import Arm
from armtempo.panel import teaching, words
from armtempo.panel.panel_board import Needs

if TYPE_CHECKING:
    from armtempo.panel.panel_page import PanelPage
    from armtempo.panel.press import Press


def build(page: PanelPage) -> None:
    """A note and a button, as long as the arm has no workspace."""
    with ui.row() as row:
        ui.label(words.NO_FLOOR).classes("armtempo-note")
        page.button(words.ASK_FLOOR, lambda _: _ask(page), Needs.CONTROL)

    def look() -> None:
        row.set_visibility(page.operator.arm.workspace is None)

    page.on_look(look)


def _ask(page: PanelPage) -> None:
    def store(press: Press) -> None:
        page.operator.check(page.client, press, Needs.CONTROL)
        if height.value is None:
            raise InputError(words.NO_HEIGHT, words.GIVE_HEIGHT)
        page.operator.arm_changed(_with_floor(page.operator.arm, float(height.value)))

    with page.ask(words.FLOOR_HINT, words.STORE, store).place:
        height = ui.number(words.FLOOR_HEIGHT, value=0.0).props("dense outlined")


def _with_floor(arm: Arm, floor_mm: float) -> Arm:
    """Write the floor into the file of an arm; the arm that is then read from it. InputError if it is none."""
    file = teaching.arm_file(arm)
    content = tomlkit.parse(file.read_text(encoding="utf-8"))
    content.setdefault("workspace", {})["floor_mm"] = floor_mm
    text = tomlkit.dumps(content)
    changed = Arm.of_table(toml_table.parse(text, arm.source))
    replace_text(file, text)
    return changed
