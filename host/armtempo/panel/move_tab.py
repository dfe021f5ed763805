"""Moving by hand: buttons to hold, postures, home, outputs and inputs, speed and pause."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nicegui import ui

from armtempo.panel import words
from armtempo.panel.held_jog import JogButton
from armtempo.panel.operator import Needs

if TYPE_CHECKING:
    from armtempo.panel.panel_page import PanelPage

AXES = ("x", "y", "z")


def build(page: PanelPage) -> None:
    """The tab."""
    _jog(page)
    _postures(page)
    _motion(page)
    _outputs(page)


def _hold_button(page: PanelPage, button: JogButton, text: str, label: str) -> None:
    """A button that moves the arm while it is held."""
    page.buttons.append(button)
    number = len(page.buttons) - 1
    made = ui.button(text).classes("armtempo-touch").props(f'unelevated aria-label="{label}"')
    made.on(
        "pointerdown",
        js_handler=f"(event) => {{ if (event.button === 0) {{ event.preventDefault(); armtempo.press({number}); }} }}",
    )
    made.on("contextmenu", js_handler="(event) => event.preventDefault()")
    page.control(made)


def _pair(page: PanelPage, name: str, number_id: str, made: dict[str, object]) -> None:
    """A row: minus, name and number, plus."""
    with ui.row().classes("no-wrap"):
        _hold_button(page, JogButton(**made, direction=-1), "−", f"{name} −")  # type: ignore[arg-type]
        ui.label(name).classes("armtempo-name ellipsis")
        _hold_button(page, JogButton(**made, direction=1), "+", f"{name} +")  # type: ignore[arg-type]
        if number_id:
            ui.label("").classes("armtempo-number").props(f'id="{number_id}"')


def _jog(page: PanelPage) -> None:
    with ui.row().classes("armtempo-apart"):
        with ui.column():
            ui.label(words.JOINTS).classes("text-subtitle2")
            for number, joint in enumerate(page.operator.arm.driven, 1):
                low, high = joint.range_deg
                with ui.row().classes("no-wrap"):
                    _pair(page, joint.name, f"armtempo-angle-{number}", {"joint": number})
                    ui.label(f"{low:g}° … {high:g}°").classes("armtempo-note")
        with ui.column():
            ui.label(words.TOOL).classes("text-subtitle2")
            for axis in AXES:
                _pair(page, axis, "", {"axis": axis})
            for axis in AXES:
                _pair(page, f"⟳ {axis}", "", {"axis": axis, "turn": True})
            ui.label("").props('id="armtempo-tool"').style("white-space: pre")
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


def _motion(page: PanelPage) -> None:
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
        clear.on_click(lambda: page.do(words.CLEAR, lambda: operator.board.clear(), Needs.COMMAND))
        page.control(clear, Needs.COMMAND)
        for text, call in (
            (words.PAUSE, lambda: operator.board.pause()),
            (words.RESUME, lambda: operator.board.resume()),
        ):
            button = ui.button(text, on_click=lambda call=call: page.at_once(call)).props("outline no-caps")
            page.control(button, Needs.BOARD)
    ui.label(words.SPEED_OF_MOTION).classes("text-caption")
    speed = ui.slider(min=1, max=100, value=100).props("label").classes("armtempo-slider")
    speed.on("change", lambda event: page.at_once(lambda: operator.board.speed(float(event.args) / 100)))
    page.control(speed, Needs.BOARD)


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
                        lambda: operator.board.output(name).set(state)
                    )
                )
                page.control(button, Needs.BOARD)
    if operator.arm.inputs:
        ui.label(words.INPUTS).classes("text-subtitle2")
        lamps = {one.name: ui.badge(one.name, color="grey") for one in operator.arm.inputs}

        def look() -> None:
            for name, lamp in lamps.items():
                active = operator.inputs.get(name)
                lamp.props(f"color={'green' if active else 'grey'}")

        page.on_look(look)
