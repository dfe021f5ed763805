"""Moving by hand: jogs that are held or make a step, outputs and inputs, and what else is on the tab for that."""

from __future__ import annotations

import math
from collections.abc import Awaitable, Iterator
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from nicegui import ui

from armtempo.model.frame import TOOL
from armtempo.model.tool_pose import BASE
from armtempo.panel import floor, homing, names, targets, teach_points, teaching, words
from armtempo.panel.panel_board import Needs
from armtempo.panel.panel_page import PanelPage, named
from armtempo.planning.jog.jog_line import axis_of
from armtempo.planning.jog.jog_motion import JogMove

if TYPE_CHECKING:
    from armtempo.panel.press import Press

AXES = ("x", "y", "z")
HOLD = "hold"
STEPS = {HOLD: words.HOLD, 0.1: "0.1", 1.0: "1", 10.0: "10"}
"""Lengths of a jog, in mm and degrees."""
JOINTS = ""
"""No frame may have this name."""
FRAMES = {JOINTS: words.JOINTS, BASE: words.BASE_FRAME, TOOL: words.TOOL_FRAME}


class MoveTab:
    """The tab of one page."""

    def __init__(self, page: PanelPage) -> None:
        self._page = page
        self._operator = page.operator
        self._step: str | float = HOLD
        self._places: dict[str, ui.column] = {}
        """Of the jogs that were built: of the joints, then of frames."""

    def parts(self) -> Iterator[None]:
        """Build them with pauses, in which the server hears the stops of other pages."""
        page = self._page
        yield from self._jogs()
        floor.build(page)
        self._home_and_teach()
        yield
        for build in (targets.build, teach_points.build, names.build):
            build(page)
            yield
        _outputs(page)
        _inputs(page)
        page.on_arm(self._changed)

    # jogs

    def _jogs(self) -> Iterator[None]:
        page = self._page
        with ui.row().classes("armtempo-choices"):
            self._frames = ui.toggle(self._frame_names(), value=JOINTS)
            named(self._frames.props("dense no-caps unelevated"), words.FRAME)
            self._frames.on_value_change(self._choose_frame)
            steps = ui.toggle(STEPS, value=HOLD, on_change=lambda event: setattr(self, "_step", event.value))
            named(steps.props("dense no-caps unelevated"), words.STEP_OF_JOG)
            self._tool_choice()
        yield
        with ui.column().classes("full-width") as self._jogs_place:
            self._show_jogs()
        yield
        with ui.element("div").classes("armtempo-slide"):
            ui.label(words.SPEED_OF_JOG).classes("text-caption")
            slider = ui.slider(min=1, max=100, value=page.jog_percent)
            named(slider.classes("armtempo-slider"), words.SPEED_OF_JOG)
            percent = ui.label(f"{page.jog_percent:g} %").classes("armtempo-percent")

            def set_percent(value: float) -> None:
                page.jog_percent = float(value)
                percent.set_text(f"{value:g} %")

            slider.on_value_change(lambda event: set_percent(event.value))

    def _choose_frame(self) -> None:
        self._show_jogs()
        self._page.refresh()

    def _frame_names(self) -> dict[str, str]:
        """What can be jogged."""
        return {**FRAMES, **{one.name: words.plain(one.name) for one in self._operator.arm.frames}}

    def _show_jogs(self) -> None:
        """Build the jogs of what is chosen when it first is: the first view does not wait for those of the frames."""
        frame = str(self._frames.value)
        if frame in self._places:
            return
        with self._jogs_place, ui.column().classes("armtempo-jogs") as place:
            (self._tool_jogs if frame else self._joint_jogs)(frame)
        self._places[frame] = place.bind_visibility_from(self._frames, "value", value=frame)

    def _joint_jogs(self, _: str) -> None:
        for number, joint in enumerate(self._operator.arm.driven):
            low, high = joint.range_deg
            with ui.element("div").classes("armtempo-jog"):
                self._pair(joint.name, JogMove(math.inf, joint=number))
                self._page.live_label(f"armtempo-angle-{number + 1}").classes("armtempo-number")
                sign = joint.unit.sign
                ui.label(f"{low:g}{sign} … {high:g}{sign}").classes("armtempo-note")

    def _tool_jogs(self, frame: str) -> None:
        """Along and about the axes of a frame."""
        for axis in AXES:
            with ui.element("div").classes("armtempo-jog"):
                name = {BASE: axis, TOOL: f"{words.OWN} {axis}"}.get(frame, f"{frame} {axis}")
                move = JogMove(math.inf, axis=axis_of(frame, axis))
                self._pair(name, move, frame)
                self._pair(f"⟳ {name}", replace(move, about=True), frame)

    def _tool_choice(self) -> None:
        """The tool that is jogged, which all pages share."""
        page, operator = self._page, self._operator
        choice = ui.select(self._tool_names(), value=operator.tool, label=words.TOOL)
        named(choice.props("dense outlined").classes("armtempo-option"), words.TOOL)
        page.control(choice, Needs.IDLE)

        def choose(press: Press, wanted: Any) -> None:
            tools = [*self._tool_names()]
            number = wanted.get("value") if isinstance(wanted, dict) else None
            try:
                if type(number) is int and 0 <= number < len(tools):
                    operator.choose_tool(page.client, press, tools[number])
            finally:
                look()

        def look() -> None:
            choice.set_visibility(len(self._tool_names()) > 1)
            if choice.value != operator.tool:
                choice.set_value(operator.tool)

        page.on_press(choice, "update:model-value", choose)
        page.on_arm(lambda: choice.set_options(self._tool_names(), value=operator.tool))
        page.on_look(look)

    def _tool_names(self) -> dict[str, str]:
        tools = self._operator.arm.tools
        return {"": words.NO_TOOL, **{one.name: words.plain(one.name) for one in tools}}

    def _changed(self) -> None:
        """Show the frames that the arm has now."""
        frames = self._frame_names()
        self._frames.set_options(frames, value=self._frames.value if self._frames.value in frames else JOINTS)
        for frame in [*self._places][1:]:
            self._places.pop(frame).delete()
        self._show_jogs()

    def _pair(self, name: str, move: JogMove, frame: str = JOINTS) -> None:
        """Minus, name, plus."""
        self._jog(replace(move, by=-move.by), "−", name, frame)
        ui.label(words.plain(name)).classes("armtempo-name ellipsis").props["title"] = words.plain(name)
        self._jog(move, "+", name, frame)

    def _jog(self, move: JogMove, sign: str, name: str, frame: str) -> None:
        page, operator = self._page, self._operator

        def why_not() -> str:
            """What is not in view is not asked for: it takes some time."""
            return operator.live.why_no_jog(move) if self._frames.value == frame else ""

        made = page.hold_button(sign, partial(self._begin, move), why_not, "unelevated", f"{name} {sign}")
        made.classes("armtempo-touch")

    def _begin(self, move: JogMove, press: Press) -> None:
        """A jog while the button is held, or a step."""
        page, operator, fraction = self._page, self._operator, self._page.jog_percent / 100
        joint = None if move.joint is None else move.joint + 1
        if isinstance(self._step, str):
            way = int(math.copysign(1, move.by))
            page.hold.press(
                page.client,
                press,
                words.JOG,
                lambda: operator.board.held_jog(joint, move.axis or None, way, move.about, fraction),
            )
            return
        by = math.copysign(self._step, move.by)
        by_deg, by_mm = (by, None) if move.unit(operator.arm) == "deg" else (None, by)
        page.do(
            press,
            words.JOG_STEP,
            lambda: operator.board.jog(joint, by_deg, move.axis or None, by_mm, fraction),
        )

    # homing and teaching

    def _home_and_teach(self) -> None:
        page = self._page
        with ui.row():
            page.button(words.HOMING, partial(homing.ask, page), Needs.COMMAND, look="outline icon=home")
            page.button(words.TEACH, self._teach, Needs.MOVE, look="outline icon=push_pin")
            page.button(
                words.BY_HAND, partial(teaching.by_hand, page), Needs.MOVE, look="outline icon=back_hand"
            )

    def _teach(self, _: Press) -> None:
        teaching.ask(self._page)


def _outputs(page: PanelPage) -> None:
    operator = page.operator
    if operator.arm.outputs:
        ui.label(words.OUTPUTS).classes("text-subtitle2")
    for output in operator.arm.outputs:
        buttons: dict[str | float, ui.button] = {}
        with ui.row():
            ui.label(words.plain(output.name))
            for state in [name for name, _ in output.states] or output.range:
                text = f"{state:g}" if isinstance(state, float) else words.plain(state)
                call = partial(_set_output, page, output.name, state)
                name = f"{output.name}: {text}"
                buttons[state] = page.button(text, call, Needs.BOARD, look="outline", name=name)

        def look(name: str = output.name, buttons: dict[str | float, ui.button] = buttons) -> None:
            """Mark the state that the board says."""
            for state, button in buttons.items():
                button.props(
                    f"aria-pressed={'true' if operator.live.outputs.get(name) == state else 'false'}"
                )

        page.on_look(look)


def _inputs(page: PanelPage) -> None:
    operator = page.operator
    if not operator.arm.inputs:
        return
    ui.label(words.INPUTS).classes("text-subtitle2")
    with ui.row():
        lamps = {
            one.name: ui.chip(words.plain(one.name)).props("dense outline color=primary")
            for one in operator.arm.inputs
        }

    def look() -> None:
        for name, lamp in lamps.items():
            active = operator.live.inputs.get(name)
            lamp.props(f"icon={'radio_button_checked' if active else 'radio_button_unchecked'}")
            named(lamp, f"{name}: {words.text(bool(active))}")

    page.on_look(look)


def _set_output(page: PanelPage, name: str, state: float | str, press: Press) -> Awaitable[object]:
    return page.at_once(press, lambda board: board.output(name).set(state))


def build(page: PanelPage) -> Iterator[None]:
    """The tab, with pauses."""
    return MoveTab(page).parts()
