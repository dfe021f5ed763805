"""The row of a tab that chooses, makes and saves the file that the tab edits."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar

from nicegui import background_tasks, ui

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
        with ui.row() as self._place:
            self._state = ui.label("").classes("armtempo-note").props('role="status"')
            self._again = page.button(words.READ_AGAIN, self._ask_again, Needs.CONTROL, look="flat dense")
        self._tried = -1
        """Time of the file when it was tried to open it again."""

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
        """Open the chosen file."""
        if event.value in (None, self._opened):
            return
        name = str(event.value)
        if not self._page.operator.why_not(self._page.client, Needs.CONTROL):
            if self._editor.has_changes:
                self._ask_lose(name)
            else:
                await self._take(name)
        self._files.set_value(self._opened)  # the previous one, if it was refused

    async def _take(self, name: str) -> None:
        """Open a file, which is checked in a thread: a pose that nothing reaches takes half a second."""
        found = await self._page.threaded(lambda: self._call(self._editor.to_open, name))
        if found is not None:
            self._editor.take(*found)

    def _ask_lose(self, name: str) -> None:
        """Open a file after a question, as it takes the place of changes."""

        def lose(press: Press) -> Awaitable[object]:
            self._page.operator.check(self._page.client, press, Needs.CONTROL)
            return self._take(name)

        self._page.ask(self._sure(), words.LOSE, lose)

    def _sure(self) -> str:
        editor = self._editor
        return words.SURE_LOSE.format(name=words.plain(editor.name)) if editor.has_changes else ""

    def _ask_again(self, _: Press) -> None:
        self._ask_lose(self._opened or "")

    async def _read_again(self) -> None:
        """Show what another program has written, unless something was changed here, or another page has done it."""
        editor, name = self._editor, self._opened or ""
        with self._place:
            found = await self._page.threaded(lambda: self._call(editor.to_open, name))
            if found is not None and editor.is_other_on_disk() and not editor.has_changes:
                editor.take(*found)
                ui.notify(words.WAS_READ_AGAIN.format(name=words.plain(name)))

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

        question = self._sure() if text == words.NEW else ""
        with self._page.ask(question, text.rstrip("…"), answered).place:
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
        is_other = editor.is_other_on_disk()
        self._again.set_visibility(is_other)
        if is_other and not editor.has_changes and self._tried != editor.looked_ns:
            self._tried = editor.looked_ns  # one that cannot be opened is tried once
            background_tasks.create(self._read_again())
        saved = words.IS_SAVED if editor.is_saved else words.NOT_SAVED
        if is_other:
            saved = f"{saved} · {words.OTHER_ON_DISK}" if editor.has_changes else words.OTHER_ON_DISK
        self._state.set_text(f"{words.plain(editor.name)} · {saved}" if editor.text else words.NOTHING_OPEN)
