"""The row of a tab that chooses, makes and saves the file that the tab edits."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar

from nicegui import ui

from armtempo.basics.errors import InputError
from armtempo.panel import words
from armtempo.panel.fields import in_words, of_a_row
from armtempo.panel.file_editor import FileEditor
from armtempo.panel.panel_board import Needs
from armtempo.panel.panel_page import named

if TYPE_CHECKING:
    from armtempo.panel.panel_page import PanelPage
    from armtempo.panel.press import Press

T = TypeVar("T")


class FileRow:
    """The row; ``look`` shows what has changed, also on another page or in the folder.

    ``of``: gives a text on the file the names of the fields in place of those of its keys.
    """

    def __init__(self, page: PanelPage, editor: FileEditor, label: str, of: Callable[[str], str]) -> None:
        self._page, self._editor, self._of = page, editor, of
        self._folder_ns = 0
        with ui.row():
            self._files = ui.select([], label=label, on_change=self._open).classes("armtempo-file")
            page.control(named(self._files.props("dense outlined"), label), Needs.CONTROL)
            for text, call, why_not in (
                (words.NEW, partial(self._ask_name, words.NEW, editor.new), str),
                (words.SAVE, self._save, self._why_nothing),
                (words.SAVE_AS, partial(self._ask_name, words.SAVE_AS, editor.save_as), self._why_nothing),
                (words.UNDO, partial(self.change, editor.undo), self._why_no_undo),
            ):
                page.button(text, call, Needs.CONTROL, why_not)
        self._state = ui.label("").classes("armtempo-note").props('role="status"')

    def change(self, call: Callable[..., object], *arguments: Any) -> None:
        """Change what is edited, or its file; the last argument is the press."""
        *given, press = arguments
        self._page.operator.check(self._page.client, press, Needs.CONTROL)
        self._call(call, *given)

    def type_in(self, call: Callable[..., object], *arguments: Any) -> None:
        """Change what is edited by what was typed, if this page has control; an error is shown."""

        def change() -> None:
            if reason := self._page.operator.why_not(self._page.client, Needs.CONTROL):
                raise InputError(reason, words.WAIT)
            with of_a_row():
                call(*arguments)

        self._page.attempt(change)

    def _call(self, call: Callable[..., T], *arguments: Any) -> T:
        with in_words(self._of), of_a_row():
            return call(*arguments)

    def _why_nothing(self) -> str:
        return "" if self._editor.text else words.NOTHING_OPEN

    def _why_no_undo(self) -> str:
        return "" if self._editor.can_undo else words.NOTHING_TO_UNDO

    async def _open(self, event: Any) -> None:
        """Open a file, which is checked in a thread: a pose that nothing reaches takes half a second."""
        if event.value in (None, self._opened):
            return
        editor, name = self._editor, str(event.value)
        if not self._page.operator.why_not(self._page.client, Needs.CONTROL):
            found = await self._page.threaded(lambda: self._call(editor.to_open, name))
            if found is not None:
                editor.take(*found)
        self._files.set_value(self._opened)  # the previous one, if it was refused

    @property
    def _opened(self) -> str | None:
        return self._editor.file.name if self._editor.file else None

    def _save(self, press: Press) -> None:
        def save() -> None:
            ui.notify(words.plain(words.SAVED.format(path=self._editor.save().name)))

        self.change(save, press)

    def _ask_name(self, text: str, call: Callable[[str], object], _: Press) -> None:
        def answered(press: Press) -> None:
            self.change(lambda: call(str(name.value or "").strip()), press)

        with self._page.ask("", text.rstrip("…"), answered).place:
            name = ui.input(words.NEW_NAME).props("dense outlined")

    def look(self) -> None:
        """Show the file, whether it has every change, and the files of the folder."""
        editor = self._editor
        now_ns = editor.folder.stat().st_mtime_ns
        if now_ns != self._folder_ns:
            self._folder_ns = now_ns
            self._files.set_options({name: words.plain(name) for name in editor.files()}, value=None)
        opened = self._opened if self._opened in self._files.options else None
        if self._files.value != opened:
            self._files.set_value(opened)
        saved = words.IS_SAVED if editor.is_saved else words.NOT_SAVED
        self._state.set_text(f"{words.plain(editor.name)} · {saved}" if editor.text else words.NOTHING_OPEN)
