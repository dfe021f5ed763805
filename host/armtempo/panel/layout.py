"""The layout of a page: header with stop, the arm, tabs; and what it is told ten times a second."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from nicegui import ui

from armtempo.basics.errors import InputError
from armtempo.kinematics.of_arm import forward
from armtempo.panel import board_tab, move_tab, plan_tab, run_tab, words
from armtempo.panel.arm_scene import ArmScene, ArmShape
from armtempo.panel.held_jog import ButtonHold
from armtempo.panel.operator import Operator
from armtempo.panel.panel_page import LOOK_S, PanelPage

TELL_S = 0.1
_SCRIPT = Path(__file__).with_name("panel.js").read_text(encoding="utf-8")
_STYLE = Path(__file__).with_name("panel.css").read_text(encoding="utf-8")


def build(operator: Operator, hold: ButtonHold, shape: ArmShape) -> PanelPage:
    """The page of the client that asks for it."""
    client = ui.context.client
    page = PanelPage(operator, hold, shape, client.id)
    ui.add_css(_STYLE)
    ui.add_body_html(f"<script>{_SCRIPT}</script>")
    ui.dark_mode(None)
    _header(page)
    with ui.element("div").classes("w-full flex flex-col lg:flex-row gap-2 no-wrap"):
        with ui.column().classes("w-full lg:w-1/2 gap-1"):
            with ui.element("div").classes("w-full h-[38vh] lg:h-[75vh] min-h-[240px]"):
                page.scene = ArmScene(shape)
            with ui.row().classes("gap-1"):
                for view, text in words.VIEWS.items():
                    ui.button(text, on_click=lambda view=view: page.scene.look(view)).props("flat dense")
        with ui.column().classes("w-full lg:w-1/2 gap-1"):
            _tabs(page)
    _events(page)
    page.refresh()
    ui.timer(LOOK_S, page.refresh)
    return page


def _header(page: PanelPage) -> None:
    operator = page.operator
    with ui.header().classes("items-center gap-3 py-1 no-wrap"):
        stop = ui.button(words.STOP, icon="front_hand", color="negative", on_click=lambda: operator.stop())
        stop.classes("armtempo-stop").tooltip(words.STOP_HINT)
        with ui.column().classes("gap-0 grow overflow-hidden"):
            ui.label(f"{words.TITLE} · {operator.arm.name}").classes("text-lg leading-tight ellipsis")
            ui.label("").classes("text-sm leading-tight ellipsis").props('id="armtempo-state" role="status"')
        take = ui.button(words.TAKE_CONTROL, on_click=lambda: operator.take_control(page.client)).props(
            "outline color=white"
        )

    def look() -> None:
        mine = operator.holder == page.client
        take.set_text(words.IN_CONTROL if mine else words.TAKE_CONTROL)
        take.set_enabled(not mine)

    page.listeners.append(look)


def _tabs(page: PanelPage) -> None:
    parts = {
        words.TAB_MOVE: move_tab.build,
        words.TAB_PLAN: plan_tab.build,
        words.TAB_RUN: run_tab.build,
        words.TAB_BOARD: board_tab.build,
    }
    with ui.tabs().classes("w-full") as tabs:
        for name in parts:
            ui.tab(name)
    with ui.tab_panels(tabs, value=words.TAB_MOVE, animated=False, keep_alive=True).classes("w-full"):
        for name, part in parts.items():
            with ui.tab_panel(name).classes("p-2"):
                part(page)


def _events(page: PanelPage) -> None:
    """What the page's script says."""
    operator, hold = page.operator, page.hold

    def press(event: Any) -> None:
        number = event.args
        if isinstance(number, int) and 0 <= number < len(page.buttons):
            page.attempt(lambda: hold.press(page.client, page.buttons[number], page.jog_percent / 100))

    ui.on("armtempo-stop", lambda: operator.stop())
    ui.on("armtempo-press", press)
    ui.on("armtempo-held", lambda: hold.alive(page.client))
    ui.on("armtempo-release", lambda: hold.release(page.client))
    lost = json.dumps(words.LOST)
    ui.run_javascript(f"document.body.dataset.lost = {lost}; armtempo.begin({page.scene.parts})")


def message(operator: Operator, shape: ArmShape) -> dict[str, Any]:
    """What all pages are told: where the arm is, and the numbers that change while it moves."""
    angles = operator.angles_deg
    texts = {"armtempo-state": state_line(operator)}
    for number, angle in enumerate(angles, 1):
        texts[f"armtempo-angle-{number}"] = f"{angle:.2f}°"
    try:
        x, y, z = forward(operator.arm, angles)[:3, 3]
        texts["armtempo-tool"] = f"x {x:.1f}  y {y:.1f}  z {z:.1f} mm"
    except InputError:
        pass
    return {"links": shape.poses(np.asarray(angles)), "texts": texts}


def state_line(operator: Operator) -> str:
    """The board's state in a line."""
    if operator.trouble:
        return operator.trouble
    state = operator.state
    if state is None:
        return ""
    kind = f" ({words.VIRTUAL})" if state.virtual else ""
    doing = f" · {operator.busy}" if operator.busy else ""
    if operator.busy and operator.progress:
        doing += f" {operator.progress:.0%}"
    fault = f" · {words.FAULT.format(fault=state.fault)}" if state.fault else ""
    return f"{state.state}{doing} · {state.port}{kind}{fault}"
