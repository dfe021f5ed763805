"""Moving by hand: buttons to hold, postures, home, outputs and inputs."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from nicegui import ui

from armtempo.panel import words
from armtempo.panel.operator import Needs
from armtempo.planning.jog.jog_motion import JogMove

if TYPE_CHECKING:
    from armtempo.panel.panel_page import PanelPage

AXES = ("x", "y", "z")
_CLEAR = Needs.COMMAND | Needs.FAULT


def build(page: PanelPage) -> None:
    """The tab."""
    _jog(page)
    _postures(page)
    _home(page)
    _outputs(page)


def _hold_button(page: PanelPage, move: JogMove, sign: str, name: str) -> None:
    """A button that moves the arm while it is held; the page's script finds it by its number."""
    made = ui.button(sign).classes("armtempo-touch")
    made.props(f'unelevated aria-label="{name} {sign}" data-jog={len(page.jogs)}')
    page.control(made, more=lambda: page.operator.live.why_no_jog(move), is_held=True)
    page.jogs.append(move)


def _pair(page: PanelPage, name: str, move: JogMove) -> None:
    """Minus, name, plus."""
    _hold_button(page, replace(move, by=-move.by), "−", name)
    ui.label(name).classes("armtempo-name ellipsis")
    _hold_button(page, move, "+", name)


def _jog(page: PanelPage) -> None:
    with ui.row().classes("armtempo-apart"):
        with ui.column():
            ui.label(words.JOINTS).classes("text-subtitle2")
            for number, joint in enumerate(page.operator.arm.driven):
                low, high = joint.range_deg
                with ui.row().classes("no-wrap"):
                    _pair(page, joint.name, JogMove(math.inf, joint=number))
                    ui.label("").classes("armtempo-number").props(f'id="armtempo-angle-{number + 1}"')
                    ui.label(f"{low:g}° … {high:g}°").classes("armtempo-note")
        with ui.column():
            ui.label(words.TOOL).classes("text-subtitle2")
            for axis in AXES:
                with ui.row().classes("no-wrap armtempo-tool"):
                    _pair(page, axis, JogMove(math.inf, axis=axis))
                    _pair(page, f"⟳ {axis}", JogMove(math.inf, axis=axis, about=True))
    ui.label(words.HOLD_HINT).classes("armtempo-note")
    ui.label(words.SPEED_OF_JOG).classes("text-caption")
    slider = ui.slider(min=1, max=100, value=page.jog_percent).props("label").classes("armtempo-slider")
    slider.on_value_change(lambda event: setattr(page, "jog_percent", float(event.value)))


def _postures(page: PanelPage) -> None:
    operator = page.operator
    names = ["home", *(posture.name for posture in operator.arm.postures)]
    with ui.row():
        ui.label(words.POSTURES).classes("text-subtitle2")
        for name in names:
            go = ui.button(name).props("outline no-caps")
            go.on_click(lambda name=name: page.do(name, lambda: operator.go(name)))
            page.control(go)


def _home(page: PanelPage) -> None:
    operator = page.operator

    async def home() -> None:
        with ui.dialog() as sure, ui.card():
            ui.label(words.SURE)
            with ui.row():
                ui.button(words.HOME, on_click=lambda: sure.submit(True))
                ui.button(words.CANCEL, on_click=lambda: sure.submit(False)).props("flat")
        if await sure:
            page.do(words.HOME, lambda: operator.board.home(operator.arm), Needs.COMMAND)

    with ui.row():
        page.control(ui.button(words.HOME, on_click=home).props("outline no-caps"), Needs.COMMAND)
        clear = ui.button(words.CLEAR).props("outline no-caps")
        clear.on_click(lambda: page.do(words.CLEAR, lambda: operator.board.clear(), _CLEAR))
        page.control(clear, _CLEAR)


def _outputs(page: PanelPage) -> None:
    operator = page.operator
    if operator.arm.outputs:
        ui.label(words.OUTPUTS).classes("text-subtitle2")
    for output in operator.arm.outputs:
        with ui.row():
            ui.label(output.name)
            for state in [name for name, _ in output.states] or output.range:
                button = ui.button(f"{state:g}" if isinstance(state, float) else state).props(
                    "outline no-caps"
                )
                button.on_click(
                    lambda name=output.name, state=state: page.at_once(
                        lambda board: board.output(name).set(state)
                    )
                )
                page.control(button, Needs.BOARD)
    if operator.arm.inputs:
        ui.label(words.INPUTS).classes("text-subtitle2")
        lamps = {one.name: ui.badge(one.name, color="grey") for one in operator.arm.inputs}

        def look() -> None:
            for name, lamp in lamps.items():
                active = operator.live.inputs.get(name)
                lamp.props(f"color={'green' if active else 'grey'}")

        page.on_look(look)
