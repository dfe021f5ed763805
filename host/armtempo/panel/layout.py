"""The layout of a page: header with stop, the arm, tabs; and the message sent to it ten times per second."""

from __future__ import annotations

import json
from contextlib import suppress
from pathlib import Path
from threading import Thread
from typing import Any

import numpy as np
from nicegui import ui

from armtempo.basics.errors import InputError
from armtempo.kinematics.chain import tool_path_mm
from armtempo.kinematics.of_arm import forward
from armtempo.panel import arm_scene, board_tab, move_tab, plan_tab, run_tab, sequence_tab, words
from armtempo.panel.arm_scene import ArmShape
from armtempo.panel.held_jog import ButtonHold
from armtempo.panel.operator import Needs, Operator
from armtempo.panel.panel_page import LOOK_S, PanelPage
from armtempo.robot.board import Board

TELL_S = 0.1
_POINTS = 200
_PRIMARY = "#2b5f8f"
"""Contrast with white: 6.6 to 1 (4.5 is required)."""
_SCRIPT = Path(__file__).with_name("panel.js").read_text(encoding="utf-8")
_STYLE = Path(__file__).with_name("panel.css").read_text(encoding="utf-8")


def build(operator: Operator, hold: ButtonHold, shape: ArmShape) -> PanelPage:
    """The page of a client."""
    client = ui.context.client
    page = PanelPage(operator, hold, shape, client.id)
    ui.add_css(_STYLE)
    ui.add_body_html(f"<script>{_SCRIPT}</script>")
    ui.dark_mode(None)
    ui.colors(primary=_PRIMARY)
    _header(page)
    with ui.element("div").classes("armtempo-page"):
        with ui.column().classes("armtempo-half"):
            page.picture = ui.element("div").classes("armtempo-scene")
            _below_scene(page)
        page.on_look(Paths(page).look)
        with ui.column().classes("armtempo-half"):
            _tabs(page)
    _events(page)
    ui.timer(0.0, lambda: page.scene, once=True)
    ui.timer(LOOK_S, page.refresh)
    return page


def _below_scene(page: PanelPage) -> None:
    """Views, speed and position of the arm, visible on every tab."""
    with ui.row():
        for view, text in words.VIEWS.items():
            ui.button(text, on_click=lambda view=view: page.scene.look(view)).props("flat dense")
        for text, call in (
            (words.PAUSE, Board.pause),
            (words.RESUME, Board.resume),
        ):
            button = ui.button(text, on_click=lambda call=call: page.at_once(call, Needs.PAUSE))
            page.control(button.props("outline dense no-caps").classes("armtempo-pause"), Needs.PAUSE)
        speed = ui.slider(min=1, max=100, value=100).props(f'label aria-label="{words.SPEED_OF_MOTION}"')
        speed.on("change", lambda event: page.at_once(lambda board: board.speed(float(event.args) / 100)))
        ui.label(words.SPEED_OF_MOTION).classes("text-caption")
        page.control(speed.classes("armtempo-speed"), Needs.BOARD)
    ui.label("").props('id="armtempo-where"')
    ui.label("").props('id="armtempo-said" role="status"')


class Paths:
    """The tool's paths of the plan and of the running or last motion, in the scene of one page."""

    def __init__(self, page: PanelPage) -> None:
        self._page = page
        self._plan: object = None
        self._run: object = None

    def look(self) -> None:
        """Draw what has changed."""
        operator, scene = self._page.operator, self._page.scene
        if (plan := operator.desk.plan) is not None and plan is not self._plan:
            self._plan = plan
            times = np.linspace(0.0, plan.total_s, _POINTS)
            scene.draw("plan", tool_path_mm(plan.arm, plan.trajectory, times), arm_scene.PATH)
        path = operator.live.run_path_mm
        if path is not self._run:
            self._run = path
            scene.draw("run", path, arm_scene.RUN)


def _header(page: PanelPage) -> None:
    operator = page.operator
    with ui.header().classes("items-center no-wrap"):
        stop = ui.button(words.STOP, icon="front_hand", color="negative", on_click=lambda: _stop(operator))
        stop.classes("armtempo-stop").tooltip(words.STOP_HINT)
        with ui.column().classes("armtempo-title"):
            ui.label(f"{words.TITLE} · {operator.arm.name}").classes("text-subtitle1 ellipsis")
            ui.label("").props('id="armtempo-state" role="status"')
        take = ui.button(words.TAKE_CONTROL, on_click=lambda: operator.take_control(page.client)).props(
            "outline color=white"
        )

    def look() -> None:
        mine = operator.holder == page.client
        take.set_text(words.IN_CONTROL if mine else words.TAKE_CONTROL)
        take.set_enabled(not mine)

    page.on_look(look)


def _tabs(page: PanelPage) -> None:
    parts = {
        words.TAB_MOVE: move_tab.build,
        words.TAB_PLAN: plan_tab.build,
        words.TAB_RUN: run_tab.build,
        words.TAB_SEQUENCE: sequence_tab.build,
        words.TAB_BOARD: board_tab.build,
    }
    with ui.tabs().classes("full-width") as tabs:
        for name in parts:
            ui.tab(name)
    with ui.tab_panels(tabs, value=words.TAB_MOVE, animated=False, keep_alive=True).classes(
        "full-width"
    ) as shown:
        places = {name: ui.tab_panel(name) for name in parts}

    def show(name: str) -> None:
        """Build a tab when it is first shown, so that the first view does not wait for charts and tables."""
        page.shown = name
        if part := parts.pop(name, None):
            with places[name]:
                part(page)
        page.refresh()

    shown.on_value_change(lambda event: show(event.value))
    show(words.TAB_MOVE)


def _stop(operator: Operator) -> None:
    """Stop in a separate thread, so that no page waits for a silent board."""
    Thread(target=operator.stop, name="armtempo panel: stop", daemon=True).start()


def _events(page: PanelPage) -> None:
    """Handle the events of the page's script."""
    operator, hold = page.operator, page.hold

    def press(event: Any) -> None:
        number = event.args
        if type(number) is int and 0 <= number < len(page.jogs):
            page.attempt(lambda: hold.press(page.client, page.jogs[number], page.jog_percent / 100))

    ui.on("armtempo-stop", lambda: _stop(operator))
    ui.on("armtempo-press", press)
    ui.on("armtempo-held", lambda: hold.alive(page.client))
    ui.on("armtempo-release", lambda: hold.release(page.client))
    lost = json.dumps(words.LOST)
    ui.run_javascript(f"document.body.dataset.lost = {lost}; armtempo.begin()")


def message(operator: Operator, shape: ArmShape) -> dict[str, Any]:
    """The message to all pages: poses of the arm, and numbers that change during a motion."""
    angles = operator.live.angles_deg
    where = "  ".join(f"{angle:.2f}°" for angle in angles)
    with suppress(InputError):
        x, y, z = forward(operator.arm, angles)[:3, 3]
        where = f"x {x:.1f}  y {y:.1f}  z {z:.1f} mm  ·  {where}"
    said = operator.live.fault or (operator.log.last[-1] if operator.log.last else "")
    texts = {"armtempo-state": state_line(operator), "armtempo-where": where, "armtempo-said": said}
    for number, angle in enumerate(angles, 1):
        texts[f"armtempo-angle-{number}"] = f"{angle:.2f}°"
    target = operator.live.target_deg
    ghost = None if target is None else shape.poses(target)
    return {"links": shape.poses(angles), "dials": shape.dials(angles), "ghost": ghost, "texts": texts}


def state_line(operator: Operator) -> str:
    """The board's state in a line."""
    if operator.trouble:
        return operator.trouble
    doing = f" · {operator.busy}" if operator.busy else ""
    if operator.busy and operator.progress:
        doing += f" {operator.progress:.0%}"
    state = operator.live.state
    if state is None:  # its program is being deployed
        return f"{operator.port}{doing}"
    kind = f" ({words.VIRTUAL})" if state.virtual else ""
    if state.moving and state.speed_percent != 100:
        speed = (
            words.AT_SPEED.format(percent=state.speed_percent) if state.speed_percent else words.IN_A_PAUSE
        )
        doing = f" {speed}{doing}"
    fault = f" · {state.fault}" if state.fault else ""
    return f"{state.state}{doing} · {state.port}{kind}{fault}"
