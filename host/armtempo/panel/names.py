"""Postures, frames and tools of the arm file: renamed and removed, after a question that names what uses them."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from nicegui import ui

from armtempo.basics.errors import InputError
from armtempo.model import arm_names, frame, tool
from armtempo.panel import teaching, words
from armtempo.panel.panel_board import Needs

if TYPE_CHECKING:
    from armtempo.panel.panel_page import PanelPage
    from armtempo.panel.press import Press


class Names:
    """The part of a page that lists them."""

    def __init__(self, page: PanelPage) -> None:
        self._page = page
        self._operator = page.operator
        page.expansion(words.NAMES, self._build)

    def _build(self) -> None:
        self._list()
        self._page.on_arm(self._list.refresh)

    @ui.refreshable_method
    def _list(self) -> None:
        arm, page = self._operator.arm, self._page
        named = {
            arm_names.POSTURE: [one.name for one in arm.postures],
            frame.KIND: [one.name for one in arm.frames],
            tool.KIND: [one.name for one in arm.tools],
        }
        with ui.element("div").classes("armtempo-names"):
            for kind, its in named.items():
                for name in its:
                    ui.label(f"{words.NAMED_KINDS[kind]} {words.plain(name)}").classes("ellipsis")
                    for text, call in ((words.RENAME, self._ask_rename), (words.REMOVE, self._ask_remove)):
                        give = partial(call, kind, name)
                        page.button(
                            text, give, Needs.CONTROL, look="flat dense", name=f"{text} {kind} {name}"
                        )
        if not any(named.values()):
            ui.label(words.NO_NAMES).classes("armtempo-note")

    def _users(self, kind: str, name: str) -> list[str]:
        """What uses the name in the project folder, and in what is edited and not saved."""
        operator = self._operator
        found = arm_names.users(teaching.arm_file(operator.arm), Path(), kind, name)
        for editor in (operator.jobs, operator.sequences):
            shown = editor.target.name
            if shown not in found and arm_names.uses(editor.content, kind, name):
                found.append(shown)
        return found

    def _used(self, kind: str, name: str) -> str:
        users = self._users(kind, name)
        return words.USED_BY.format(users=", ".join(users)) if users else words.NOT_USED

    def _ask_rename(self, kind: str, name: str, _: Press) -> None:
        def rename(press: Press) -> None:
            self._check(press)
            new = str(wanted.value or "").strip()
            arm = arm_names.rename(teaching.arm_file(self._operator.arm), kind, name, new)
            chosen = self._operator.tool
            self._operator.arm_changed(arm, new if kind == tool.KIND and chosen == name else chosen)
            self._page.refresh()

        question = words.SURE_RENAME.format(kind=words.NAMED_KINDS[kind], name=name)
        asked = self._page.ask(words.plain(f"{question} {self._used(kind, name)}"), words.RENAME, rename)
        with asked.place:
            wanted = ui.input(words.NEW_NAME, value=name).props("dense outlined")

    def _ask_remove(self, kind: str, name: str, _: Press) -> None:
        def remove(press: Press) -> None:
            self._check(press)
            if kind == tool.KIND and self._operator.tool == name:
                raise InputError(words.TOOL_IS_ON.format(name=name), words.CHOOSE_NO_TOOL)
            arm = arm_names.remove(teaching.arm_file(self._operator.arm), kind, name)
            self._operator.arm_changed(arm)
            self._page.refresh()

        question = words.SURE_REMOVE_NAME.format(kind=words.NAMED_KINDS[kind], name=name)
        self._page.ask(words.plain(f"{question} {self._used(kind, name)}"), words.REMOVE, remove)

    def _check(self, press: Press) -> None:
        """Nothing moves meanwhile: what it moves by would be another one."""
        self._operator.check(self._page.client, press, Needs.IDLE)


def build(page: PanelPage) -> None:
    """The part of a page."""
    Names(page)
