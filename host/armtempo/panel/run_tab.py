"""Running: the plan on the board with its progress, live curves, past runs with their reports."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any
from urllib.parse import quote, urlencode

import numpy as np
from nicegui import background_tasks, run, ui

from armtempo.basics.errors import InputError
from armtempo.panel import past_runs, words
from armtempo.panel.charts import CurveChart
from armtempo.panel.panel_board import Needs
from armtempo.panel.panel_page import named
from armtempo.panel.past_runs import PastRun
from armtempo.report import run_report
from armtempo.report.comparison import PAGE as COMPARISON
from armtempo.robot.motions import MOST_REPETITIONS

if TYPE_CHECKING:
    from armtempo.model.plan import Plan
    from armtempo.panel.panel_page import PanelPage
    from armtempo.panel.press import Press

_MOST_RUNS = 30
_MOST_POINTS = 150
_CURVES_S = 0.5
"""Interval at which the curves are drawn anew: they take a browser most of its time."""
_ADDRESS = "/runs"


class RunTab:
    """The tab of one page."""

    def __init__(self, page: PanelPage) -> None:
        self._page = page
        self._operator = operator = page.operator
        self._shown = (-1, 0)
        self._drawn_s = 0.0
        self._known: list[PastRun] = []
        self._listing = False
        self._chosen: set[str] = set()
        """Names of the runs to compare; they stay chosen when another run is added to the list."""
        self._compare: ui.button | None = None
        self._plan = ui.label("").classes("text-subtitle2")
        with ui.row():
            for text, call, needs, icon, look in (
                (words.TO_START, operator.go, Needs.MOVE, "start", "outline"),
                (words.RUN, self._run, Needs.MOVE, "play_arrow", ""),
                (words.UPLOAD, operator.upload, Needs.COMMAND, "upload", "outline"),
            ):
                give = partial(self._do, text, call, needs)
                page.button(text, give, needs | Needs.PLAN, look=f"{look} icon={icon}")
            # Without limits: the field would put another number in the place of one that is not possible
            self._repeat = ui.number(words.REPEAT, value=1)
            self._repeat.props("dense outlined").classes("armtempo-option")
        self._bar = ui.linear_progress(0.0, show_value=False).classes("full-width")
        self._left = ui.label("").classes("armtempo-note")
        self._angles = CurveChart(operator.arm, words.ANGLE, 0)
        self._speeds = CurveChart(operator.arm, words.SPEED, 1)
        self._errors = CurveChart(operator.arm, words.ERROR, 0)
        ui.label(words.DOTTED).classes("armtempo-note")
        ui.label(words.PAST_RUNS).classes("text-subtitle2")
        self._past()
        page.on_look(self._look)

    def _do(self, text: str, call: Callable[[Plan], object], needs: Needs, press: Press) -> None:
        """Start a command with the plan."""
        if (plan := self._operator.jobs.plan) is not None:
            self._page.do(press, text, lambda: call(plan), needs | Needs.PLAN)

    def _run(self, plan: Plan) -> None:
        times = self._repeat.value or 0
        if times not in range(1, MOST_REPETITIONS + 1):
            raise InputError(
                words.WRONG_REPEAT.format(times=f"{times:g}"),
                words.RIGHT_REPEAT.format(most=MOST_REPETITIONS),
            )
        self._operator.run(plan, int(times))

    def _look(self) -> None:
        self._look_at_plan()
        if not self._listing:
            self._listing = True
            background_tasks.create(self._look_at_runs())
        self._look_at_curves()

    async def _look_at_runs(self) -> None:
        """List what was recorded, also by the command line; the first time, hundreds of files may be read."""
        try:
            found = await run.io_bound(past_runs.listed, self._operator.runs, _MOST_RUNS)
        finally:
            self._listing = False
        if found is not None and found != self._known and not self._left.is_deleted:
            self._known = found
            self._past.refresh()

    def _look_at_plan(self) -> None:
        operator, jobs = self._operator, self._operator.jobs
        if jobs.plan is None:
            self._plan.set_text(words.NO_PLAN)
        elif jobs.plan_is_old:
            self._plan.set_text(words.PLAN_IS_OLD)
        else:
            file = jobs.file.name if jobs.file else words.NOT_SAVED
            self._plan.set_text(
                words.PLANNED.format(name=jobs.plan.job.name, total=jobs.plan.total_s, file=file)
            )
        running = operator.live.plan if operator.busy else None
        self._bar.set_visibility(running is not None)
        self._left.set_visibility(running is not None)
        if running is not None:
            state = operator.live.state
            percent = (state.speed_percent if state else None) or 100.0
            self._bar.set_value(operator.progress)
            self._left.set_text(
                words.LEFT.format(
                    name=running.job.name, part=operator.progress, left=operator.left * 100.0 / percent
                )
            )

    def _look_at_curves(self) -> None:
        operator = self._operator
        curves = operator.live.curves
        state = (curves.run, len(curves.time_s))
        now_s = time.monotonic()
        if state == self._shown or state[1] < 2 or (operator.busy and now_s - self._drawn_s < _CURVES_S):
            return
        self._shown, self._drawn_s = state, now_s
        live, plan = curves.thinned(_MOST_POINTS), operator.live.plan
        planned = [plan.trajectory(live.path_s, order) if plan else None for order in (0, 1)]
        self._angles.show(live.time_s, live.angle_deg, planned[0])
        self._speeds.show(live.time_s, np.gradient(live.angle_deg, live.time_s, axis=0), planned[1])
        self._errors.show(live.time_s, live.angle_deg - live.commanded_deg)

    @ui.refreshable_method
    def _past(self) -> None:
        names = [one.folder.name for one in self._known]
        self._chosen &= set(names)
        if not names:
            ui.label(words.NO_RUNS).classes("armtempo-note")
            return
        with ui.element("div").classes("armtempo-runs"):
            for text in ("", *words.RUN_COLUMNS):
                ui.label(text).classes("text-caption")
            for one, name in zip(self._known, names, strict=True):
                box = ui.checkbox(value=name in self._chosen, on_change=partial(self._choose, name))
                named(box.props("dense"), f"{words.COMPARE}: {name}")
                for text in (name, one.date, one.duration, one.ending):
                    ui.label(words.plain(text))
                report = _link(ui.button(words.REPORT), f"{_ADDRESS}/{quote(name)}/{run_report.PAGE}")
                named(report.props("flat dense no-caps"), f"{words.REPORT}: {name}")
        if len(names) > 1:
            compare = _link(ui.button(words.COMPARE), "").props("outline no-caps")
            self._page.control(compare, None, self._why_no_comparison)
            self._compare = compare
            self._offer()

    def _choose(self, name: str, event: Any) -> None:
        """Note whether a run is to be compared."""
        (self._chosen.add if event.value else self._chosen.discard)(name)
        self._offer()

    def _offer(self) -> None:
        """The chosen runs, in the address of the comparison."""
        if self._compare is not None:
            query = urlencode({"run": sorted(self._chosen)}, doseq=True)
            self._compare.props["href"] = f"{_ADDRESS}/{COMPARISON}?{query}"
            self._page.refresh()

    def _why_no_comparison(self) -> str:
        return "" if len(self._chosen) > 1 else words.CHOOSE_TWO


def _link(button: ui.button, address: str) -> ui.button:
    """Open a page of the server in a new tab: the browser does, which keeps a server from it if that takes long."""
    button.props["href"] = address
    return button.props("target=_blank")


def build(page: PanelPage) -> None:
    """The tab."""
    RunTab(page)
