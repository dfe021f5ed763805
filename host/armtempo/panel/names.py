"""Postures, frames and tools of the arm file: renamed and removed, after a question that names what uses them."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from nicegui import ui

from armtempo.basics.errors import InputError
from armtempo.model import arm_names, frame, tool
from armtempo.model.arm_names import Use
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

    def _uses(self, kind: str, name: str) -> list[Use]:
        """The lines that use a name; of what is edited and not saved, its keys."""
        operator = self._operator
        found = arm_names.uses_in_files(teaching.arm_file(operator.arm), Path(), kind, name)
        for editor in (operator.jobs, operator.sequences):
            if not editor.is_saved:
                places = arm_names.uses(editor.content, kind, name)
                found += [Use(editor.target, 0, place, follows=True) for place in places]
        return found

    def _list_uses(self, title: str, uses: list[Use]) -> None:
        if uses:
            ui.label(title)
            with ui.element("div").classes("armtempo-uses"):
                for use in uses:
                    line = words.USE.format(line=use.line) if use.line else words.UNSAVED
                    ui.label(words.plain(f"{use.file.name}, {line}: {use.text}"))

    def _ask_rename(self, kind: str, name: str, _: Press) -> None:
        file, uses = teaching.arm_file(self._operator.arm), self._uses(kind, name)

        def rename(press: Press) -> None:
            self._check(press)
            self._rename(kind, name, str(wanted.value or "").strip(), follow.value)

        question = words.SURE_RENAME.format(kind=words.NAMED_KINDS[kind], name=name)
        with self._page.ask(words.plain(question), words.RENAME, rename).place:
            wanted = ui.input(words.NEW_NAME, value=name).props("dense outlined")
            self._list_uses(words.USED_IN, [use for use in uses if use.follows])
            follow = ui.switch(words.FOLLOW, value=True)
            follow.set_visibility(any(use.follows and use.file != file for use in uses))
            self._list_uses(words.BY_YOURSELF, [use for use in uses if not use.follows])
            if not uses:
                ui.label(words.NOT_USED)

    def _rename(self, kind: str, name: str, new: str, follow: bool) -> None:
        """Give a name in the arm file; with ``follow`` in the jobs and sequences, and in what is edited, too."""
        operator = self._operator
        editors = (operator.jobs, operator.sequences) if follow else ()
        rewritten = [
            editor.rewritten(lambda text: arm_names.renamed(text, kind, name, new)) for editor in editors
        ]
        arm = arm_names.rename(teaching.arm_file(operator.arm), kind, name, new, Path() if follow else None)
        for take in rewritten:
            take()
        chosen = operator.tool
        operator.arm_changed(arm, new if kind == tool.KIND and chosen == name else chosen)
        operator.say(words.RENAMED.format(kind=words.NAMED_KINDS[kind], name=name, new=new))
        self._page.refresh()

    def _ask_remove(self, kind: str, name: str, _: Press) -> None:
        uses = self._uses(kind, name)

        def remove(press: Press) -> None:
            self._check(press)
            if kind == tool.KIND and self._operator.tool == name:
                raise InputError(words.TOOL_IS_ON.format(name=name), words.CHOOSE_NO_TOOL)
            arm = arm_names.remove(teaching.arm_file(self._operator.arm), kind, name)
            self._operator.arm_changed(arm)
            self._page.refresh()

        question = words.SURE_REMOVE_NAME.format(kind=words.NAMED_KINDS[kind], name=name)
        with self._page.ask(words.plain(question), words.REMOVE, remove).place:
            self._list_uses(words.USED_IN, uses)
            if not uses:
                ui.label(words.NOT_USED)

    def _check(self, press: Press) -> None:
        """Nothing moves meanwhile: what it moves by would be another one."""
        self._operator.check(self._page.client, press, Needs.IDLE)


def build(page: PanelPage) -> None:
    """The part of a page."""
    Names(page)
