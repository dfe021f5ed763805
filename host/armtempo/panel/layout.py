"""The layout of a page: header with stop, banner, the arm, tabs, and below them what is always in view."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable, Iterator
from functools import partial
from pathlib import Path
from threading import Thread
from typing import Any

import numpy as np
from nicegui import ui

from armtempo.kinematics.chain import tool_path_mm
from armtempo.panel import (
    arm_scene,
    board_tab,
    job_tab,
    live_texts,
    move_tab,
    problem,
    run_tab,
    sequence_tab,
    words,
)
from armtempo.panel.arm_scene import ArmShape
from armtempo.panel.hold import ButtonHold
from armtempo.panel.panel_board import Needs, PanelBoard
from armtempo.panel.panel_page import LOOK_S, PanelPage, named
from armtempo.panel.press import Press
from armtempo.robot.board import Board

TELL_S = 0.1
LEFT_S = 1.0
"""A slider that was not moved for this long is not being dragged."""
_POINTS = 200
_PRIMARY = "#2b5f8f"
"""Contrast with white: 6.6 to 1 (4.5 is required)."""
_SCRIPT = Path(__file__).with_name("panel.js").read_text(encoding="utf-8")
_STYLE = Path(__file__).with_name("panel.css").read_text(encoding="utf-8")


async def build(operator: PanelBoard, hold: ButtonHold, shape: ArmShape) -> PanelPage:
    """The page of a client, with pauses, in which the server hears the stops of other pages."""
    client = ui.context.client
    page = PanelPage(operator, hold, shape, client.id)
    ui.add_css(_STYLE)
    lost = json.dumps({"lost": words.LOST})
    ui.add_body_html(f"<script>{_SCRIPT}armtempo.wait({lost});</script>")
    ui.dark_mode(None)
    ui.colors(primary=_PRIMARY)
    with ui.element("div").classes("armtempo-page"):
        _header(page)
        problem.build(page)
        await asyncio.sleep(0)
        with ui.element("div").classes("armtempo-main"):
            with ui.element("div").classes("armtempo-picture"):
                page.picture = ui.element("div").classes("armtempo-scene")
                _views(page)
            with ui.element("div").classes("armtempo-tabs"):
                for _ in _tabs(page):
                    await asyncio.sleep(0)
        _dock(page)
    page.on_look(Paths(page).look)
    _events(page)
    ui.timer(0.0, lambda: page.scene, once=True)
    ui.timer(LOOK_S, page.refresh)
    return page


def _header(page: PanelPage) -> None:
    operator = page.operator
    with ui.element("header").classes("armtempo-header"):
        stop = ui.button(
            words.STOP, icon="front_hand", color="negative", on_click=lambda: _aside(operator.stop)
        )
        stop.classes("armtempo-stop").props("no-caps").tooltip(words.STOP_HINT)
        freeze = ui.button(words.FREEZE, icon="ac_unit", on_click=lambda: _aside(operator.freeze))
        freeze.classes("armtempo-freeze").props("no-caps outline").tooltip(words.FREEZE_HINT)
        with ui.element("div").classes("armtempo-title"):
            ui.label(f"{words.TITLE} · {words.plain(operator.arm.name)}").classes("armtempo-name-of-arm")
            page.live_label("armtempo-state").props('role="status"')
        take = ui.button(words.TAKE_CONTROL).props("outline color=white no-caps").classes("armtempo-take")

        def taken(press: Press, _: object) -> None:
            operator.presses.take(page.client, press)
            operator.take_control(page.client)

        page.on_press(take, "click", taken)

    def look() -> None:
        mine = operator.holder == page.client
        take.set_text(words.IN_CONTROL if mine else words.TAKE_CONTROL)
        take.set_enabled(not mine)

    page.on_look(look)


def _views(page: PanelPage) -> None:
    """The views of the arm; the chosen one is marked."""
    with ui.element("div").classes("armtempo-views"):
        views = ui.toggle(
            words.VIEWS, value="free", on_change=lambda event: page.scene.look(str(event.value))
        )
        named(views.props("dense no-caps unelevated"), words.VIEW)
        frames = ui.switch(words.FRAMES_SHOWN, value=True).props("dense")
        frames.on_value_change(
            lambda event: ui.run_javascript(f"armtempo.show_frames({json.dumps(event.value)})")
        )
    scale = ", ".join(f"rgb({255 * r:.0f} {255 * g:.0f} {255 * b:.0f})" for r, g, b in arm_scene.SLOW_TO_FAST)
    page.speeds = ui.label("").classes("armtempo-speed-scale")
    page.speeds.style(f"background-image: linear-gradient(to right, {scale})")
    page.speeds.set_visibility(False)
    page.live_label("armtempo-unknown")


def _dock(page: PanelPage) -> None:
    """Position, last message, pause and speed: in view on every tab."""

    def why_no_resume() -> str:
        state = page.operator.live.state
        return words.NOT_PAUSED if state is not None and state.speed_percent else ""

    with ui.element("footer").classes("armtempo-dock"):
        page.live_label("armtempo-where")
        page.live_label("armtempo-said").props('role="status"')
        with ui.element("div").classes("armtempo-speeds"):
            for text, icon, call, why_not in (
                (words.PAUSE, "pause", Board.pause, str),
                (words.RESUME, "play_arrow", Board.resume, why_no_resume),
            ):
                give = partial(page.at_once, call=call, needs=Needs.PAUSE)
                page.button(text, give, Needs.PAUSE, why_not, f"outline dense icon={icon}")
            _speed(page)


def _speed(page: PanelPage) -> None:
    """The board's speed, as it says; what is set here and is not taken goes back to that."""
    operator, clock = page.operator, page.operator.presses.clock
    ui.label(words.SPEED_OF_MOTION).classes("text-caption")
    slider = ui.slider(min=1, max=100, value=100)
    named(slider.classes("armtempo-speed"), words.SPEED_OF_MOTION)
    value = ui.label("").classes("armtempo-percent")
    page.control(slider, Needs.BOARD)
    shown = [0.0]
    touched_s = [0.0]
    slider.on_value_change(lambda: touched_s.__setitem__(0, clock()))

    def set_speed(press: Press, wanted: Any) -> Awaitable[object]:
        return page.at_once(press, lambda board: board.speed(float(wanted) / 100))

    page.on_press(slider, "change", set_speed)

    def look() -> None:
        state = operator.live.state
        if state is None or not (percent := state.speed_percent):
            return
        if percent != shown[0] or (slider.value != percent and clock() - touched_s[0] > LEFT_S):
            shown[0] = percent
            slider.set_value(percent)
            value.set_text(f"{percent:g} %")

    page.on_look(look)


class Paths:
    """The tool's paths of the plan and of the running or last motion, in the scene of one page."""

    def __init__(self, page: PanelPage) -> None:
        self._page = page
        self._plan: object = None
        self._run: object = None

    def look(self) -> None:
        """Draw what has changed."""
        operator, scene = self._page.operator, self._page.scene
        if (plan := operator.jobs.plan) is not None and plan is not self._plan:
            self._plan = plan
            times = np.linspace(0.0, plan.total_s, _POINTS)
            path = tool_path_mm(plan.arm, plan.trajectory, times)
            colours, fastest = arm_scene.colours_of_speed(path, times)
            scene.draw("plan", path, colours)
            self._page.speeds.set_text(words.PATH_SPEED.format(fastest=fastest))
            self._page.speeds.set_visibility(True)
        path = operator.live.run_path_mm
        if path is not self._run:
            self._run = path
            scene.draw("run", path, arm_scene.RUN)


def _tabs(page: PanelPage) -> Iterator[None]:
    """The tabs; the first one is built at once, with pauses."""
    parts: dict[str, Callable[[PanelPage], object]] = {
        words.TAB_MOVE: move_tab.build,
        words.TAB_JOB: job_tab.build,
        words.TAB_RUN: run_tab.build,
        words.TAB_SEQUENCE: sequence_tab.build,
        words.TAB_BOARD: board_tab.build,
    }
    with ui.tabs().classes("full-width").props("no-caps dense") as tabs:
        for name in parts:
            ui.tab(name)
    with ui.tab_panels(tabs, value=words.TAB_MOVE, animated=False, keep_alive=True).classes(
        "armtempo-panels"
    ) as shown:
        places = {name: ui.tab_panel(name) for name in parts}

    def show(name: str) -> None:
        """Build a tab when it is first shown, so that the first view does not wait for charts and tables."""
        page.shown = name
        if part := parts.pop(name, None):
            with places[name]:
                page.build(name, lambda: part(page))
        page.refresh()

    shown.on_value_change(lambda event: show(event.value))
    page.shown, build_first = words.TAB_MOVE, parts.pop(words.TAB_MOVE)
    with places[words.TAB_MOVE]:
        yield from page.parts(words.TAB_MOVE, lambda: build_first(page))
    page.refresh()


def _aside(call: Any) -> None:
    """Stop in a separate thread, so that no page waits for a silent board."""
    Thread(target=call, name="armtempo panel: stop", daemon=True).start()


def _events(page: PanelPage) -> None:
    """Handle the events of the page's script."""
    operator, hold = page.operator, page.hold

    def press(event: Any) -> None:
        press, number = Press.of(event.args), event.args.get("hold")
        if type(number) is int and 0 <= number < len(page.holds):
            page.holds[number](press)

    def released(event: Any) -> None:
        if type(number := event.args) is int:
            hold.release(page.client, number)

    ui.on("armtempo-stop", lambda: _aside(operator.stop))
    ui.on("armtempo-press", lambda event: page.answer(event.args, page.refusal(lambda: press(event))))
    ui.on("armtempo-held", lambda event: page.attempt(lambda: hold.alive(page.client, Press.of(event.args))))
    ui.on("armtempo-release", released)
    ui.run_javascript("armtempo.begin()")


def message(operator: PanelBoard, shape: ArmShape) -> dict[str, Any]:
    """The message to all pages: poses of the arm, and numbers that change during a motion."""
    live = operator.live
    angles, target = live.angles_deg, live.target_deg
    poses = shape.poses(angles)
    return {
        "clock_s": operator.presses.clock(),
        "state": operator.presses.state,
        "links": poses if live.known else None,
        "dials": shape.dials(angles),
        "tool": shape.tool(angles) if live.known else None,
        "ghost": poses if not live.known else None if target is None else shape.poses(target),
        "unknown": not live.known,
        "old": live_texts.is_old(operator),
        "freeze": operator.can_freeze,
        "texts": live_texts.texts(operator),
    }
