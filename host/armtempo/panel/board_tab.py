"""The board: its state, its stored motions, the log."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING

from nicegui import ui

from armtempo.panel import words

if TYPE_CHECKING:
    from armtempo.panel.panel_page import PanelPage

_SHOWN = (
    "port",
    "board_id",
    "state",
    "fault",
    "arm",
    "arm_problem",
    "speed_percent",
    "max_rate",
    "max_rate_sum",
    "free_flash",
    "free_heap",
    "frames_bad",
    "samples_lost",
)


class BoardTab:
    """The tab of one page."""

    def __init__(self, page: PanelPage) -> None:
        self._page = page
        self._operator = page.operator
        ui.label(words.STATUS).classes("text-subtitle2")
        columns = [{"name": name, "label": "", "field": name, "align": "left"} for name in ("key", "value")]
        self._state = ui.table(columns=columns, rows=[]).props("dense flat hide-header wrap-cells")
        with ui.row().classes("items-center gap-2"):
            ui.label(words.STORED).classes("text-subtitle2")
            page.control(ui.button(icon="refresh", on_click=self._read).props("flat dense"), moves=False)
        self._stored = ui.column().classes("gap-1")
        ui.label(words.LOG).classes("text-subtitle2")
        self._log = ui.log(max_lines=200).classes("w-full h-48")
        self._logged = 0
        page.listeners.append(self._look)

    def _look(self) -> None:
        state = self._operator.state
        if state is not None:
            values = asdict(state)
            rows = [
                {"key": key.replace("_", " "), "value": str(values[key])}
                for key in _SHOWN
                if values[key] != ""
            ]
            if rows != self._state.rows:
                self._state.rows = rows
        lines = list(self._operator.log)
        new = self._operator.lines - self._logged
        for line in lines[-new:] if new else ():
            self._log.push(line)
        self._logged = self._operator.lines

    def _read(self) -> None:
        def read() -> None:
            motions = self._operator.board.list()
            self._stored.clear()
            with self._stored:
                for motion in motions:
                    self._row(motion.name, motion.duration_s)

        self._page.attempt(read)

    def _row(self, name: str, duration_s: float) -> None:
        operator = self._operator
        with ui.row().classes("items-center gap-2"):
            ui.label(f"{name} · {duration_s:.3f} s")
            run = ui.button(words.RUN).props("outline dense no-caps")
            run.on_click(
                lambda: self._page.do(name, lambda: operator.board.run(name, 1, operator.runs, operator.part))
            )
            self._page.control(run)
            remove = ui.button(words.REMOVE).props("flat dense no-caps")
            remove.on_click(
                lambda: self._page.do(words.REMOVE, lambda: operator.board.remove(name), moves=False)
            )
            self._page.control(remove, moves=False)


def build(page: PanelPage) -> None:
    """The tab."""
    BoardTab(page)
