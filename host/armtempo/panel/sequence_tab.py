"""Sequences: a table of the steps; plan, play and run them, with the current step highlighted."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

from armtempo_shared.sequence import ENDINGS, FINISHED, MOVE, WAIT
from nicegui import ui

from armtempo import pipeline
from armtempo.model.steps import position, whole_cycles
from armtempo.panel import words
from armtempo.panel.fields import Fields, in_words
from armtempo.panel.file_row import FileRow
from armtempo.panel.panel_board import Needs
from armtempo.panel.panel_page import build_rows, named
from armtempo.panel.plan_row import PlanRow
from armtempo.panel.sequence_editor import KINDS, kind_of

if TYPE_CHECKING:
    from armtempo.basics.arrays import Array
    from armtempo.basics.progress import Progress
    from armtempo.link.board_messages import SequenceState
    from armtempo.model.plan import Plan
    from armtempo.panel.panel_page import PanelPage
    from armtempo.panel.press import Press

_LIT = "armtempo-lit"


class SequenceTab:
    """The tab of one page; the steps are the panel's, so that every page sees them."""

    def __init__(self, page: PanelPage) -> None:
        self._page = page
        self._operator = page.operator
        self._editor = page.operator.sequences
        self._shown = self._editor.version
        self._lit = 0
        self._fields: dict[int, Fields] = {}
        """Of each row."""
        self._jobs: list[str] = []
        """The files of jobs that a step can name."""
        self._built: tuple[object, list[str]] = None, []
        """What the table was built for, as ``_form``."""
        self._rows: list[ui.row] = []
        self._times: dict[int, ui.label] = {}
        self._timed: Plan | None = None
        self._file = FileRow(page, self._editor, words.SEQUENCE_FILE, words.of_sequence)
        with ui.row():
            self._plan_row = PlanRow(
                page, lambda: self._planned, Needs.IDLE, self._why_nothing, words.of_error
            )
            for text, call, look in (
                (words.TO_START, self._to_start, "outline icon=start"),
                (words.RUN, self._run, "icon=play_arrow"),
            ):
                page.button(text, call, Needs.MOVE, self._why_not, look=look)
            play = ui.button(words.PLAY, on_click=self._play).props("outline no-caps icon=smart_display")
            page.control(play, None, self._why_no_play)
        self._total = ui.label("").props('role="status"')
        self._where = ui.label("").props('role="status"')
        self._table()
        page.on_look(self._look)
        ui.context.client.on_connect(self._connected)

    def _connected(self) -> None:
        for fields in self._fields.values():
            fields.send_again()

    def _form(self) -> tuple[object, list[str]]:
        """What the table is built for, and each row: their values may change without building them anew."""
        kinds = [kind_of(step) for step in self._editor.steps]
        return (self._editor.file, len(kinds), self._editor.depths), kinds

    def _why_nothing(self) -> str:
        return "" if self._editor.is_open else words.NO_SEQUENCE_OPEN

    def _why_not(self) -> str:
        return self._plan_row.why_not() or self._why_nothing()

    def _why_no_play(self) -> str:
        return "" if self._editor.plan else words.NO_PLAN

    # the table

    @ui.refreshable_method
    def _table(self) -> None:
        self._rows, self._times, self._fields, self._timed = [], {}, {}, None
        self._built, self._lit = self._form(), 0
        self._jobs, count = self._operator.jobs.files(), len(self._editor.steps)
        build_rows(ui.column(), count, self._row)
        if self._editor.is_open:
            with ui.row():
                add = partial(self._file.change, self._editor.add, count)
                self._page.button(words.ADD_STEP, add, Needs.CONTROL)
                self._page.button(words.ADD_HERE, partial(self._add_here, count), Needs.CONTROL)

    def _add_here(self, index: int, press: Press) -> None:
        here_deg = [round(float(angle), 4) + 0.0 for angle in self._operator.live.angles_deg]
        self._file.change(self._editor.add, index, {"goto": here_deg}, press)

    def _row(self, index: int) -> None:
        row = ui.row().classes("armtempo-step").style(f"margin-left: {1.5 * self._editor.depths[index]}rem")
        self._rows.append(row)
        self._fill(index)

    def _fill(self, index: int) -> None:
        """Build what is in a row, for its kind of step; in other rows a list may be open."""
        page, editor = self._page, self._editor
        step = editor.steps[index]
        kind = kind_of(step)
        self._fields[index] = Fields()
        with self._rows[index]:
            ui.label(str(index + 1)).classes("armtempo-number")
            choice = ui.select(words.STEP_KINDS, value=kind).props("dense outlined")
            named(choice, f"{words.STEP} {index + 1}")
            choice.on_value_change(lambda event: self._set_kind(index, kind, str(event.value)))
            page.control(choice, Needs.CONTROL)
            for key in (kind, *KINDS[kind]):
                label = None if key == kind else words.STEP_KEYS[key]
                box = self._field(index, key, step.get(key, ""), label)
                box.classes("armtempo-value" if KINDS[kind] else "armtempo-wide")
            for icon, text, call in (
                ("arrow_upward", words.UP, partial(editor.move, index, -1)),
                ("arrow_downward", words.DOWN, partial(editor.move, index, 1)),
                ("content_copy", words.COPY, partial(editor.copy, index)),
                ("delete", words.DELETE, partial(editor.delete, index)),
            ):
                name = f"{text} {words.STEP} {index + 1}"
                change = partial(self._file.change, call)
                page.button("", change, Needs.CONTROL, look=f"flat dense icon={icon}", name=name)
            time = "" if self._timed is None else _time_of(self._timed, index + 1)
            self._times[index] = ui.label(time).classes("armtempo-note")

    def _field(self, index: int, key: str, value: str, label: str | None) -> ui.input:
        """A field for the value of a key, with what it can name as a list."""
        # A name that cannot be shown as it is could only be completed to another one
        choices = [name for name in self._editor.choices(key, self._jobs) if name == words.plain(name)]
        box = ui.input(label, value=value, autocomplete=choices)
        named(box.props("dense outlined"), f"{words.STEP} {index + 1}: {label or words.STEP_KINDS[key]}")
        self._fields[index].add(box, lambda: self._editor.steps[index].get(key, ""))
        box.on("change", lambda event: self._set(index, key, str(event.args or "").strip()))
        self._page.control(box, Needs.CONTROL)
        return box

    def _set_kind(self, index: int, shown: str, kind: str) -> None:
        if kind != shown:
            self._file.type_in(self._editor.set_kind, index, kind)

    def _set(self, index: int, key: str, text: str) -> None:
        """Set a value, and show how the file has it at once: later it would replace what is typed next."""
        self._file.type_in(self._editor.set, index, key, text)
        self._look()

    def _look(self) -> None:
        self._file.look()
        if self._editor.version != self._shown:
            self._shown = self._editor.version
            (table, kinds), (built_table, built_kinds) = self._form(), self._built
            if table != built_table:
                self._table.refresh()  # later
            else:
                for index, row in enumerate(self._rows):
                    if kinds[index] == built_kinds[index]:
                        self._fields[index].look()
                    else:
                        row.clear()
                        self._fill(index)
                self._built = table, kinds
        self._look_at_times()
        state = self._operator.live.sequence
        running = state is not None and state.ending == "running"
        step = state.step if state is not None and running else 0
        if step != self._lit:
            for number, row in enumerate(self._rows, 1):
                if number in (step, self._lit):
                    row.classes(add=_LIT) if number == step else row.classes(remove=_LIT)
            self._lit = step
        if state is not None:
            self._where.set_text(_where(state))

    def _look_at_times(self) -> None:
        """The planned time of each step, and of all."""
        if (plan := self._editor.plan) is self._timed:
            return
        self._timed = plan
        for index, label in self._times.items():
            label.set_text("" if plan is None else _time_of(plan, index + 1))
        if plan is None:
            self._total.set_text("")
        elif plan.total is None:
            cycles = "; ".join(words.CYCLE_TIME.format(time=one.share.total_s) for one in plan.cycles)
            self._total.set_text(cycles)
        else:
            self._total.set_text(words.TOTAL_TIME.format(time=plan.total.total_s))

    # plan, play, run

    def _planned(self, progress: Progress) -> Plan:
        """The plan of the present steps."""
        if (plan := self._editor.plan) is None:
            version = self._editor.version
            with in_words(words.of_sequence):
                plan = pipeline.plan_sequence(self._editor.arm, self._editor.sequence(), progress)
            self._editor.planned(plan, version)
        return plan

    async def _play(self) -> None:
        """Play every motion on the model, each once; pressed again, stop it."""
        page = self._page
        if (plan := self._editor.plan) is None or page.is_playing:
            page.stop_playing()
            return
        for row in [row for row in plan.rows if row.op == MOVE]:
            leg = plan.legs[row.number].trajectory
            if not await page.play(leg.duration_s, partial(_show, page, leg)):
                break
        page.show_ghost(None)

    def _to_start(self, press: Press) -> None:
        self._page.do(
            press, words.TO_START, lambda: self._operator.go(self._planned(self._operator.preparing))
        )

    def _run(self, press: Press) -> None:
        operator = self._operator

        def run_it() -> None:
            operator.run_sequence(self._planned(operator.preparing))

        self._page.do(press, words.RUN, run_it)


def _show(page: PanelPage, leg: Callable[[float], Array], time_s: float) -> None:
    page.show_ghost(leg(time_s))


def _where(state: SequenceState) -> str:
    """Where a sequence is, or how it ended."""
    if state.ending == ENDINGS[FINISHED]:
        return f"{state.ending}: {whole_cycles(state.cycle)}"
    return f"{state.ending}: {position(state.step, state.cycle)}"


def _time_of(plan: Plan, step: int) -> str:
    """The planned time of a step, once; "" for one that takes none."""
    moves = [
        plan.legs[row.number].trajectory.duration_s
        for row in plan.rows
        if row.step == step and row.op == MOVE
    ]
    waits = [row.amount / 1000 for row in plan.rows if row.step == step and row.op == WAIT]
    time_s: Any = sum(moves) + sum(waits)
    return f"{time_s:.2f} s" if time_s else ""


def build(page: PanelPage) -> None:
    """The tab."""
    SequenceTab(page)
