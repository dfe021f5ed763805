"""The plan of the panel's job: made, played on the model, with its curves."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from nicegui import ui

from armtempo import pipeline
from armtempo.panel import words
from armtempo.panel.charts import CurveChart
from armtempo.panel.fields import in_words
from armtempo.panel.panel_board import Needs
from armtempo.panel.panel_page import named
from armtempo.panel.plan_row import PlanRow

if TYPE_CHECKING:
    from armtempo.basics.progress import Progress
    from armtempo.model.plan import Plan
    from armtempo.panel.panel_page import PanelPage

_POINTS = 200
_SLIDER = 1000
"""The slider's end."""
_MARK_S = 0.2
"""Interval at which the curves' cursors move: a browser draws each chart anew for it."""


class JobPlan:
    """Its part of the job's tab, on one page; the plan is the panel's."""

    def __init__(self, page: PanelPage) -> None:
        self._page = page
        self._operator = page.operator
        self._jobs = page.operator.jobs
        self._played: Plan | None = None
        self._marked_s = 0.0
        with ui.row():
            PlanRow(page, self._begin, Needs.CONTROL, str, lambda error: words.of_job(str(error)))
            self._result = ui.label("").props('role="status"')
        self._play_row()
        self._charts = [
            CurveChart(page.operator.arm, title, order)
            for order, title in enumerate((words.ANGLE, words.SPEED, words.ACCELERATION, words.JERK))
        ]

    def _begin(self) -> Callable[[Progress], object]:
        """What plans the job as it is now."""
        with in_words(words.of_job):
            job, version = self._jobs.job(), self._jobs.version
        arm = self._jobs.arm
        return lambda progress: self._jobs.planned(pipeline.plan(arm, job, progress), version)

    # on the model

    def _play_row(self) -> None:
        with ui.row().classes("no-wrap full-width"):
            play = ui.button(icon="play_arrow", on_click=self._play).props("outline dense")
            named(play, words.PLAY)
            self._page.control(play, None, self._why_no_play)
            self._play_button = play
            self._slider = ui.slider(min=0, max=_SLIDER, value=0, on_change=self._show_time)
            named(self._slider, words.PLAY_TIME)
            self._page.control(self._slider, None, self._why_no_play)
            self._time = ui.label("").classes("armtempo-percent")

    def _why_no_play(self) -> str:
        return "" if self._played else words.NO_PLAN

    def _show_time(self) -> None:
        if (plan := self._played) is not None:
            time_s = plan.total_s * self._slider.value / _SLIDER
            self._time.set_text(f"{time_s:.2f} s")
            self._page.show_ghost(plan.trajectory(time_s))
            now_s = time.monotonic()
            if now_s - self._marked_s > _MARK_S or self._slider.value == _SLIDER:
                self._marked_s = now_s
                for chart in self._charts:
                    chart.mark(time_s)

    async def _play(self) -> None:
        """Play the motion; pressed again, stop it."""
        page = self._page
        if (plan := self._played) is None or page.is_playing:
            page.stop_playing()
            return
        await page.play(
            plan.total_s, lambda time_s: self._slider.set_value(round(_SLIDER * time_s / plan.total_s))
        )

    def look(self) -> None:
        """Show a plan that is new, also by another page."""
        self._result.set_text(self._describe_plan())
        self._play_button.set_icon("stop" if self._page.is_playing else "play_arrow")
        plan = self._jobs.plan
        if plan is None or plan is self._played:
            return
        self._played = plan
        times = np.linspace(0.0, plan.total_s, _POINTS)
        for order, chart in enumerate(self._charts):
            chart.show(times, plan.trajectory(times, order))

    def _describe_plan(self) -> str:
        plan = self._jobs.plan
        if plan is None:
            return words.NO_PLAN
        if self._jobs.plan_is_old:
            return words.PLAN_IS_OLD
        bound = max(search.lower_bound_s for search in plan.searches)
        return words.MOTION_TIME.format(total=plan.total_s, bound=bound)
