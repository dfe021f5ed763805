"""Sequences: a table of the steps; save, plan and run, with the current step highlighted."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from nicegui import ui

from armtempo import pipeline
from armtempo.panel import words
from armtempo.panel.operator import Needs
from armtempo.panel.sequence_desk import KINDS, kind_of

if TYPE_CHECKING:
    from armtempo.model.sequence_plan import SequencePlan
    from armtempo.panel.panel_page import PanelPage

_LIT = "armtempo-lit"


class SequenceTab:
    """The tab of one page; the steps are the panel's, so that every page sees them."""

    def __init__(self, page: PanelPage) -> None:
        self._page = page
        self._operator = page.operator
        self._desk = page.operator.sequences
        self._shown = self._desk.version
        self._lit = 0
        self._rows: list[ui.row] = []
        self._folder_ns = 0
        self._none = ui.label(words.NO_SEQUENCE)
        with ui.row():
            self._files = ui.select([], label=words.SEQUENCE_FILE, on_change=self._open)
            page.control(self._files.style("min-width: 12rem"), Needs.IDLE)
            for text, call, needs in (
                (words.SAVE_SEQUENCE, self._save, Needs.IDLE),
                (words.TO_START, self._to_start, Needs.MOVE),
                (words.RUN, self._run, Needs.MOVE),
            ):
                page.control(ui.button(text, on_click=call).props("outline no-caps"), needs, self._why_not)
        self._where = ui.label("").props('role="status"')
        self._table()
        page.on_look(self._look)
        ui.context.client.on_connect(self._connected)

    def _connected(self) -> None:
        """Show the steps again, as texts typed while the connection was broken have not arrived."""
        self._shown = -1

    def _why_not(self) -> str:
        return words.NO_SEQUENCE_OPEN if self._desk.file is None else ""

    @ui.refreshable_method
    def _table(self) -> None:
        self._rows = []
        steps = self._desk.steps
        for index, step in enumerate(steps):
            self._rows.append(self._row(index, step))
        if self._desk.file is not None:
            add = ui.button(words.ADD_STEP, on_click=lambda: self._desk.add(len(steps)))
            self._page.control(add.props("outline no-caps"), Needs.IDLE)

    def _row(self, index: int, step: dict[str, str]) -> ui.row:
        page, desk, kind = self._page, self._desk, kind_of(step)
        with ui.row().classes("armtempo-step") as row:
            ui.label(str(index + 1)).classes("armtempo-number")
            choice = ui.select(words.STEP_KINDS, value=kind).props(
                f'dense outlined aria-label="{words.STEP} {index + 1}"'
            )
            choice.on_value_change(lambda event: desk.set_kind(index, str(event.value)))
            page.control(choice, Needs.IDLE)
            for key in (kind, *KINDS[kind]):
                box = ui.input(None if key == kind else words.STEP_KEYS[key], value=step.get(key, ""))
                box.props(f'dense outlined aria-label="{words.STEP} {index + 1}: {key}"')
                box.on("change", lambda event, key=key: self._set(index, key, str(event.args or "").strip()))
                page.control(box.classes("armtempo-value"), Needs.IDLE)
            for icon, text, call in (
                ("arrow_upward", words.UP, lambda: desk.move(index, -1)),
                ("arrow_downward", words.DOWN, lambda: desk.move(index, 1)),
                ("add", words.ADD_STEP, lambda: desk.add(index)),
                ("delete", words.DELETE, lambda: desk.delete(index)),
            ):
                button = ui.button(icon=icon, on_click=call)
                page.control(
                    button.props(f'flat dense aria-label="{text} {words.STEP} {index + 1}"'), Needs.IDLE
                )
        return row

    def _set(self, index: int, key: str, text: str) -> None:
        """Set a value; the table is not rebuilt, as the user may already type in the next field."""
        others = self._desk.version - self._shown
        self._desk.set(index, key, text)
        self._shown = self._desk.version - others

    def _look_for_files(self) -> None:
        """Offer the files of the folder, if that has changed."""
        now_ns = self._desk.folder.stat().st_mtime_ns
        if now_ns == self._folder_ns:
            return
        self._folder_ns, files = now_ns, self._desk.files()
        self._none.set_visibility(not files)
        if files != self._files.options:
            self._files.set_options(files, value=self._opened)

    def _look(self) -> None:
        self._look_for_files()
        if self._desk.version != self._shown:
            self._shown = self._desk.version
            self._files.set_value(self._opened)  # another page may have opened it
            self._table.refresh()
            self._lit = 0
        state = self._operator.live.sequence
        running = state is not None and state.ending == "running"
        step = state.step if state is not None and running else 0
        if step != self._lit:
            for number, row in enumerate(self._rows, 1):
                if number in (step, self._lit):
                    row.classes(add=_LIT) if number == step else row.classes(remove=_LIT)
            self._lit = step
        if state is not None:
            text = words.STEP_NOW.format(step=state.step, cycle=state.cycle)
            self._where.set_text(text if running else f"{text}: {state.ending}")

    def _open(self, event: object) -> None:
        name = getattr(event, "value", None)
        if name not in (None, self._opened):
            self._attempt(lambda: self._desk.open(str(name)))
            self._files.set_value(self._opened)  # the previous one, if it was refused

    @property
    def _opened(self) -> str | None:
        """The name of the file whose steps are shown."""
        return self._desk.file.name if self._desk.file else None

    def _save(self) -> None:
        self._attempt(lambda: ui.notify(words.SAVED.format(path=self._desk.save().name)))

    def _attempt(self, call: Callable[[], object]) -> None:
        if self._page.attempt(lambda: self._page.check(Needs.IDLE)):
            self._page.attempt(call)

    def _planned(self) -> SequencePlan:
        """The plan of the present steps."""
        if self._desk.plan is None:
            self._desk.plan = pipeline.plan_sequence(
                self._desk.arm, self._desk.sequence(), self._operator.part
            )
        return self._desk.plan

    def _to_start(self) -> None:
        self._page.do(words.TO_START, lambda: self._operator.go(self._planned()))

    def _run(self) -> None:
        operator = self._operator

        def run() -> None:
            plan = self._planned()
            board = operator.board
            operator.live.take_sequence(
                board.run_sequence(plan, operator.live.take_sequence, replace=True, out=operator.runs)
            )
            if (recorded := board.last_sequence) is not None:
                pipeline.report(recorded)

        self._page.do(words.RUN, run)


def build(page: PanelPage) -> None:
    """The tab."""
    SequenceTab(page)
