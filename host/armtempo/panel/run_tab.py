"""Running: the plan on the board, live curves, past runs with their reports."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import quote

import numpy as np
from nicegui import ui

from armtempo import pipeline
from armtempo.panel import words
from armtempo.panel.charts import CurveChart
from armtempo.panel.operator import Needs

if TYPE_CHECKING:
    from armtempo.model.plan import Plan
    from armtempo.panel.panel_page import PanelPage

REPORT_PAGE = "report.html"
_MOST_RUNS = 30
_MOST_POINTS = 300


class RunTab:
    """The tab of one page."""

    def __init__(self, page: PanelPage) -> None:
        self._page = page
        self._operator = operator = page.operator
        self._shown = (-1, 0)
        self._ended = page.operator.ended
        with ui.row():
            for text, call, needs in (
                (words.TO_START, operator.go, Needs.MOVE),
                (words.RUN, self._run, Needs.MOVE),
                (words.UPLOAD, operator.upload, Needs.COMMAND),
            ):
                button = ui.button(text).on_click(partial(self._do, text, call, needs))
                page.control(button, needs | Needs.PLAN)
            self._repeat = ui.number(words.REPEAT, value=1, precision=0).props("dense outlined")
        ui.label(words.DOTTED).classes("armtempo-note")
        self._angles = CurveChart(self._operator.arm, words.ANGLE, 0)
        self._speeds = CurveChart(self._operator.arm, words.SPEED, 1)
        self._errors = CurveChart(self._operator.arm, words.ERROR, 0)
        ui.label(words.PAST_RUNS).classes("text-subtitle2")
        self._past()
        page.on_look(self._look)

    def _do(self, text: str, call: Callable[[Plan], object], needs: Needs) -> None:
        """Start a command with the plan."""
        if (plan := self._operator.desk.plan) is not None:
            self._page.do(text, lambda: call(plan), needs)

    def _run(self, plan: Plan) -> None:
        self._operator.run(plan, int(self._repeat.value or 0))

    def _look(self) -> None:
        operator = self._operator
        if self._ended != operator.ended:  # perhaps a run, with a new report
            self._ended = operator.ended
            self._past.refresh()
        curves = operator.live.curves
        state = (curves.run, len(curves.time_s))
        if state == self._shown or state[1] < 2:
            return
        self._shown = state
        live, plan = curves.thinned(_MOST_POINTS), operator.live.plan
        planned = [plan.trajectory(live.path_s, order) if plan else None for order in (0, 1)]
        self._angles.show(live.time_s, live.angle_deg, planned[0])
        self._speeds.show(live.time_s, np.gradient(live.angle_deg, live.time_s, axis=0), planned[1])
        self._errors.show(live.time_s, live.angle_deg - live.commanded_deg)

    @ui.refreshable_method
    def _past(self) -> None:
        folders = past_runs(self._operator.runs)
        chosen: list[Path] = []
        for folder in folders[:_MOST_RUNS]:
            with ui.row():
                ui.checkbox(
                    folder.name, on_change=lambda event, folder=folder: _choose(chosen, folder, event.value)
                )
                if (folder / REPORT_PAGE).is_file():
                    ui.link(words.REPORT, _address(folder / REPORT_PAGE), new_tab=True)
        if len(folders) > 1:
            ui.button(words.COMPARE, on_click=lambda: self._compare(chosen)).props("outline no-caps")

    async def _compare(self, folders: list[Path]) -> None:
        if page := await self._page.threaded(lambda: pipeline.compare(folders)):
            ui.navigate.to(_address(page), new_tab=True)


def _choose(chosen: list[Path], folder: Path, wanted: bool) -> None:
    if wanted:
        chosen.append(folder)
    elif folder in chosen:
        chosen.remove(folder)


def _address(file: Path) -> str:
    """The panel's path of a file of a run folder."""
    return f"/runs/{quote(file.parent.name)}/{quote(file.name)}"


def past_runs(folder: Path) -> list[Path]:
    """The run folders in ``folder``, the newest first."""
    if not folder.is_dir():
        return []
    found = [path.parent for path in folder.glob("*/run.json")]
    return sorted(found, key=lambda path: path.stat().st_mtime, reverse=True)


def build(page: PanelPage) -> None:
    """The tab."""
    RunTab(page)
