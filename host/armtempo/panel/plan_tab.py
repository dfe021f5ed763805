"""Planning: a table of via points, options, the plan with its curves, played on the model before the board gets it."""

from __future__ import annotations

import asyncio
import math
from typing import TYPE_CHECKING

import numpy as np
from nicegui import run, ui

from armtempo import pipeline
from armtempo.basics.arrays import Array
from armtempo.basics.errors import ArmtempoError, InputError
from armtempo.kinematics.chain import chains_mm
from armtempo.kinematics.solver import moved_tool_deg
from armtempo.model import via_table
from armtempo.model.job import DEGREES, PATHS, TIMINGS
from armtempo.panel import words
from armtempo.panel.charts import CurveChart
from armtempo.panel.operator import Needs

if TYPE_CHECKING:
    from armtempo.model.plan import Plan
    from armtempo.panel.panel_page import PanelPage

_POINTS = 200
_PLAY_S = 0.05
_CHOICES = {"path": PATHS, "timing": TIMINGS, "degree": DEGREES}


class PlanTab:
    """The tab of one page; its plan is the panel's, so that every page can run it."""

    def __init__(self, page: PanelPage) -> None:
        self._page = page
        self._operator = page.operator
        self._rows: list[list[float]] = page.operator.desk.rows()
        self._planning = self._cancelled = False
        self._played: Plan | None = None
        page.scene.picked, page.scene.dragged = self._pick, self._drag
        self._table()
        ui.label(words.DRAG_HINT).classes("armtempo-note")
        self._offered = ui.column()
        self._draw_vias()
        with ui.row():
            ui.button(words.NEW_VIA, on_click=self._add_via).props("outline no-caps")
            ui.button(words.FROM_ARM, on_click=self._take_posture).props("outline no-caps")
            ui.button(words.PASTE, on_click=self._paste).props("outline no-caps")
            page.control(ui.button(words.SAVE, on_click=self._save).props("outline no-caps"), Needs.CONTROL)
        with ui.row():
            self._options = {key: self._option(key, label) for key, label in words.OPTIONS.items()}
        with ui.row():
            page.control(ui.button(words.PLAN, on_click=self._plan), Needs.CONTROL, self._why_no_plan)
            self._stop = ui.button(words.CANCEL, on_click=self._cancel).props("flat")
            self._stop.set_visibility(False)
        self._bar = ui.linear_progress(0.0, show_value=False).classes("full-width")
        self._bar.set_visibility(False)
        self._result = ui.label("")
        self._slider = ui.slider(min=0, max=1000, value=0, on_change=self._show_time)
        page.control(self._slider.props(f'label aria-label="{words.PLAY_TIME}"'), None, self._why_no_play)
        with ui.row():
            play = ui.button(words.PLAY, icon="play_arrow", on_click=self._play).props("outline no-caps")
            page.control(play, None, self._why_no_play)
        self._charts = [
            CurveChart(page.operator.arm, title, order)
            for order, title in enumerate((words.ANGLE, words.SPEED, words.ACCELERATION, words.JERK))
        ]
        page.on_look(self._look)
        # Texts typed while the connection was broken have not arrived
        ui.context.client.on_connect(self._changed)

    def _option(self, key: str, label: str) -> ui.select | ui.input:
        """The field of a key of the job."""
        value, choices = self._operator.desk.option(key), _CHOICES.get(key)
        if choices is None:
            return ui.input(label, value=value).props("dense outlined").classes("armtempo-value")
        named = {choice: words.CHOICES.get(choice, choice) for choice in map(str, choices)}
        return ui.select(named, value=value, label=label).props("dense outlined").classes("armtempo-option")

    def _given(self) -> dict[str, str]:
        """The options in the fields."""
        return {key: str(one.value or "").strip() for key, one in self._options.items()}

    # the table

    @ui.refreshable_method
    def _table(self) -> None:
        joints = self._operator.arm.driven
        with ui.grid(columns=f"auto repeat({len(joints)}, minmax(4.5rem, 7rem)) auto").classes(
            "armtempo-grid"
        ):
            ui.label("")
            for joint in joints:
                ui.label(joint.name).classes("text-caption ellipsis")
            ui.label("")
            for number, row in enumerate(self._rows):
                ui.label(f"P{number}")
                for index, joint in enumerate(joints):
                    box = ui.number(value=row[index], step=1, format="%.3f")
                    box.props(f'dense outlined aria-label="P{number} {joint.name}"')
                    box.on_value_change(
                        lambda event, number=number, index=index: self._edit(number, index, event.value)
                    )
                ui.button(icon="delete", on_click=lambda number=number: self._delete(number)).props(
                    f'flat dense aria-label="{words.DELETE} P{number}"'
                )

    def _edit(self, number: int, index: int, value: float | None) -> None:
        self._rows[number][index] = math.nan if value is None else float(value)
        self._draw_vias()

    def _add_via(self) -> None:
        self._rows.append(list(self._rows[-1]) if self._rows else list(self._operator.arm.home_deg))
        self._changed()

    def _take_posture(self) -> None:
        self._rows.append([round(float(angle), 4) for angle in self._operator.live.angles_deg])
        self._changed()

    def _delete(self, number: int) -> None:
        del self._rows[number]
        self._changed()

    async def _paste(self) -> None:
        with ui.dialog() as asked, ui.card():
            text = ui.textarea(words.PASTE_HINT).style("min-width: min(24rem, 80vw)")
            with ui.row():
                ui.button(words.PASTE, on_click=lambda: asked.submit(text.value))
                ui.button(words.CANCEL, on_click=lambda: asked.submit(None)).props("flat")
        given = await asked
        if given:
            self._page.attempt(lambda: self._take_rows(given))

    def _take_rows(self, text: str) -> None:
        found = via_table.of_text(text, words.PASTED, self._operator.arm)
        if found.poses:
            raise InputError(
                "the table has poses, here are angles", "make a job of it: 'armtempo import', and open that"
            )
        self._rows = found.via_deg.tolist()
        self._changed()

    def _changed(self) -> None:
        self._table.refresh()
        self._draw_vias()

    def _draw_vias(self) -> None:
        rows = np.array(self._rows).reshape(-1, len(self._operator.arm.driven))
        if np.isfinite(rows).all():
            self._page.scene.dots(chains_mm(self._operator.arm, rows)[:, -1])

    # in 3-D

    def _tool_mm(self, number: int) -> Array:
        """Position of the tool at a via point, (3,)."""
        place: Array = chains_mm(self._operator.arm, np.array(self._rows[number]))[-1]
        return place

    def _pick(self, number: int) -> None:
        """Show a via point and the other postures that reach it."""
        if number < len(self._rows):
            self._page.attempt(lambda: self._offer(number, self._tool_mm(number)))

    def _drag(self, number: int, position_mm: Array) -> None:
        """Move a via point to where it was dragged; back if no posture reaches that."""
        if number < len(self._rows):
            self._page.attempt(lambda: self._offer(number, position_mm))
            self._draw_vias()

    def _offer(self, number: int, position_mm: Array) -> None:
        """Take the posture that is nearest to the via point's, and offer the others."""
        postures = moved_tool_deg(self._operator.arm, np.array(self._rows[number]), position_mm.tolist())
        texts = [", ".join(f"{angle:.1f}" for angle in posture) + "°" for posture in postures]
        self._offered.clear()
        with self._offered:
            ui.label(words.POSTURES_OF.format(number=number, count=len(postures)))
            ui.radio(
                dict(enumerate(texts)),
                value=0,
                on_change=lambda event: self._take(number, postures[int(event.value)]),
            ).props("dense")
        self._take(number, postures[0])

    def _take(self, number: int, posture_deg: Array) -> None:
        self._rows[number] = [round(float(angle), 4) for angle in posture_deg]
        self._page.show_ghost(posture_deg)
        self._changed()

    # the plan

    def _why_no_plan(self) -> str:
        return words.BUSY.format(what=words.PLAN) if self._planning else ""

    def _why_no_play(self) -> str:
        return "" if self._played else words.NO_PLAN

    async def _plan(self) -> None:
        try:
            job = self._operator.desk.job_with(self._rows, self._given())
            self._show_planning(True)
            self._operator.desk.plan = await run.io_bound(
                pipeline.plan, self._operator.arm, job, self._progress
            )
        except ArmtempoError as error:
            ui.notify(str(error), type="negative", multi_line=True, timeout=8000)
        except asyncio.CancelledError:
            pass
        finally:
            self._show_planning(False)

    def _show_planning(self, planning: bool) -> None:
        self._planning, self._cancelled = planning, False
        self._bar.set_visibility(planning)
        self._stop.set_visibility(planning)
        self._page.refresh()

    def _progress(self, done: float, whole: float) -> None:
        if self._cancelled:
            raise InputError(words.CANCELLED, words.PLAN_AGAIN)
        self._bar.value = done / whole if whole else 0.0

    def _cancel(self) -> None:
        self._cancelled = True

    def _save(self) -> None:
        def save() -> None:
            ui.notify(words.SAVED.format(path=self._operator.desk.save(self._rows, self._given())))

        self._page.attempt(save)

    def _look(self) -> None:
        """Show a new plan, also one from another page."""
        plan = self._operator.desk.plan
        if plan is None or plan is self._played:
            return
        self._played = plan
        floor = max(search.floor_s for search in plan.searches)
        self._result.set_text(words.MOTION_TIME.format(total=plan.total_s, floor=floor))
        times = np.linspace(0.0, plan.total_s, _POINTS)
        for order, chart in enumerate(self._charts):
            chart.show(times, plan.trajectory(times, order))

    def _show_time(self) -> None:
        if (plan := self._played) is not None:
            angles = plan.trajectory(plan.total_s * self._slider.value / 1000)
            self._page.show_ghost(angles)

    async def _play(self) -> None:
        if (plan := self._played) is None:
            return
        for time_s in np.arange(0.0, plan.total_s, _PLAY_S):
            self._slider.set_value(round(1000 * float(time_s) / plan.total_s))
            await asyncio.sleep(_PLAY_S)
        self._slider.set_value(1000)


def build(page: PanelPage) -> None:
    """The tab."""
    PlanTab(page)
