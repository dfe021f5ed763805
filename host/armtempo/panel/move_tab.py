"""Moving by hand: homing, jogs that are held or make a step, targets, teaching, outputs and inputs."""

from __future__ import annotations

import math
from collections.abc import Awaitable, Callable
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from nicegui import ui

from armtempo.basics.arrays import Array
from armtempo.basics.errors import ArmtempoError, InputError
from armtempo.kinematics.of_arm import forward
from armtempo.model.frame import TOOL
from armtempo.model.pose import checked, from_rpy, to_rpy_deg
from armtempo.model.tool_pose import BASE
from armtempo.panel import arm_scene, floor, homing, teach_points, teaching, words
from armtempo.panel.hold import SHOWN_S
from armtempo.panel.panel_board import Needs
from armtempo.panel.panel_page import PanelPage, named
from armtempo.planning.jog.jog_line import axis_of
from armtempo.planning.jog.jog_motion import JogMove
from armtempo.robot.goto import MovePace, posture_deg

if TYPE_CHECKING:
    from armtempo.panel.press import Press

AXES = ("x", "y", "z")
HOLD = "hold"
_SAME_DEG = 1e-3
_THERE_DEG = 0.1
"""An arm that is this close to a target has arrived."""
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
        self._target_deg: Array | None = None
        """What the ghost shows."""
        self._found_deg: Array | None = None
        """A target that a thread found, and that is to be shown."""
        self._jogs()
        floor.build(page)
        self._targets()
        self._home_and_teach()
        _outputs(page)
        _inputs(page)
        page.on_look(self._look)
        page.on_arm(self._changed)

    def _look(self) -> None:
        """Show a target that was found; take the ghost away where the arm has arrived."""
        found_deg, self._found_deg = self._found_deg, None
        if found_deg is not None:
            self._show(found_deg)
        target_deg, operator = self._target_deg, self._operator
        if target_deg is None or operator.busy:
            return
        if np.abs(operator.live.angles_deg - target_deg).max() < _THERE_DEG:
            self._target_deg = None
            self._page.show_ghost(None)
            self._page.scene.draw("way", np.empty((0, 3)), arm_scene.WAY)

    # jogs

    def _jogs(self) -> None:
        page = self._page
        with ui.row().classes("armtempo-choices"):
            self._frames = ui.toggle(self._frame_names(), value=JOINTS)
            named(self._frames.props("dense no-caps unelevated"), words.FRAME)
            self._frames.on_value_change(page.refresh)
            steps = ui.toggle(STEPS, value=HOLD, on_change=lambda event: setattr(self, "_step", event.value))
            named(steps.props("dense no-caps unelevated"), words.STEP_OF_JOG)
            self._tool_choice()
        with self._jogs_of(JOINTS):
            for number, joint in enumerate(page.operator.arm.driven):
                low, high = joint.range_deg
                with ui.element("div").classes("armtempo-jog"):
                    self._pair(joint.name, JogMove(math.inf, joint=number))
                    ui.label("").classes("armtempo-number").props(f'id="armtempo-angle-{number + 1}"')
                    sign = joint.unit.sign
                    ui.label(f"{low:g}{sign} … {high:g}{sign}").classes("armtempo-note")
        self._tool_jogs()
        with ui.element("div").classes("armtempo-slide"):
            ui.label(words.SPEED_OF_JOG).classes("text-caption")
            slider = ui.slider(min=1, max=100, value=page.jog_percent)
            named(slider.classes("armtempo-slider"), words.SPEED_OF_JOG)
            percent = ui.label(f"{page.jog_percent:g} %").classes("armtempo-percent")

            def set_percent(value: float) -> None:
                page.jog_percent = float(value)
                percent.set_text(f"{value:g} %")

            slider.on_value_change(lambda event: set_percent(event.value))

    def _frame_names(self) -> dict[str, str]:
        """What can be jogged."""
        return {**FRAMES, **{one.name: words.plain(one.name) for one in self._operator.arm.frames}}

    def _jogs_of(self, frame: str) -> ui.column:
        """The place of the jogs along the axes of a frame, in view while that is chosen."""
        place = ui.column().classes("armtempo-jogs")
        return place.bind_visibility_from(self._frames, "value", value=frame)

    @ui.refreshable_method
    def _tool_jogs(self) -> None:
        """Along and about the axes of each frame that there is."""
        for frame in list(self._frame_names())[1:]:
            with self._jogs_of(frame):
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
            names = [*self._tool_names()]
            number = wanted.get("value") if isinstance(wanted, dict) else None
            try:
                if type(number) is int and 0 <= number < len(names):
                    operator.choose_tool(page.client, press, names[number])
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
        """Show the postures and frames that the arm has now."""
        names = self._frame_names()
        self._frames.set_options(names, value=self._frames.value if self._frames.value in names else JOINTS)
        self._tool_jogs.refresh()
        self._posture_buttons.refresh()

    def _pair(self, name: str, move: JogMove, frame: str = JOINTS) -> None:
        """Minus, name, plus."""
        self._jog(replace(move, by=-move.by), "−", name, frame)
        ui.label(words.plain(name)).classes("armtempo-name ellipsis")
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

    # targets

    def _targets(self) -> None:
        page, arm = self._page, self._operator.arm
        with ui.row():
            ui.label(words.GO_TO).classes("text-subtitle2")
            one_click = ui.switch(words.ONE_CLICK)
        self._one_click = one_click
        self._posture_buttons()
        with ui.expansion(words.TYPED_TARGET).props("dense").classes("armtempo-expansion"):
            with ui.row():
                kind = ui.toggle({"angles": words.ANGLES, "pose": words.POSE}, value="angles")
                named(kind.props("dense no-caps unelevated"), words.FORM_OF_TARGET)
                line = ui.switch(words.IN_A_LINE)
                ui.button(words.TAKE_PRESENT, on_click=self._take_present).props("flat dense no-caps")
            with ui.row().classes("armtempo-fields").bind_visibility_from(kind, "value", value="angles"):
                self._angles = [
                    _number(joint.labelled, angle)
                    for joint, angle in zip(arm.driven, arm.home_deg, strict=True)
                ]
            with ui.row().classes("armtempo-fields").bind_visibility_from(kind, "value", value="pose"):
                self._pose = {name: _number(name, 0.0) for name in words.POSE_FIELDS}
                self._frame = ui.select({BASE: words.IN_BASE}, value=BASE).props("dense outlined")
                named(self._frame, words.FRAME_OF_POSE)
                self._offer_frames()
                page.on_arm(self._offer_frames)
                if len(arm.driven) < len(words.POSE_FIELDS):
                    ui.label(words.FEW_JOINTS.format(joints=len(arm.driven))).classes("armtempo-note")
            with ui.row():
                ui.button(words.SHOW, on_click=lambda: self._show_typed(kind.value)).props("outline no-caps")

                def begin(press: Press) -> None:
                    self._go_typed(self._typed(kind.value), line.value, press)

                page.hold_button(words.GO, begin, look="unelevated", name=f"{words.GO}: {words.TYPED_TARGET}")
        ui.label(words.TARGET_HINT).classes("armtempo-note")
        teach_points.build(page)

    def _offer_frames(self) -> None:
        """The frames in which a pose can be typed."""
        frames = self._operator.arm.frames
        names = {BASE: words.IN_BASE} | {each.name: words.plain(each.name) for each in frames}
        self._frame.set_options(names, value=self._frame.value if self._frame.value in names else BASE)
        self._frame.set_visibility(bool(frames))

    @ui.refreshable_method
    def _posture_buttons(self) -> None:
        page, arm = self._page, self._operator.arm
        with ui.row().classes("armtempo-postures"):
            for name in ["home", *(posture.name for posture in arm.postures)]:
                begin = partial(self._go, name)
                page.hold_button(words.plain(name), begin, name=f"{words.GO_TO} {name}")

    def _go(self, name: str, press: Press) -> None:
        """Show a posture; go there while the button is held, or with one click."""
        target_deg = posture_deg(name, self._operator.arm)
        self._show(target_deg)
        self._check_away(target_deg)
        self._move(name, lambda: target_deg, False, press)

    def _go_typed(self, find: Callable[[], Array], line: bool, press: Press) -> None:
        """The same with a typed target, which takes some time to find."""

        def found() -> Array:
            target_deg = self._found_deg = find()
            self._check_away(target_deg)
            return target_deg

        self._move(words.TYPED_TARGET, found, line, press)

    def _check_away(self, target_deg: Array) -> None:
        if np.abs(self._operator.live.angles_deg - target_deg).max() < _SAME_DEG:
            raise InputError(words.IS_THERE, words.OTHER_TARGET)

    def _move(self, what: str, find: Callable[[], Array], line: bool, press: Press) -> None:
        """Go to the target that a thread finds."""
        page, operator = self._page, self._operator
        pace = MovePace(page.jog_percent / 100, line)
        if self._one_click.value:
            page.do(press, what, lambda: operator.go(find(), pace))
            return
        page.hold.press(page.client, press, what, lambda: operator.held_move(find(), pace), SHOWN_S)

    def _show(self, target_deg: Array) -> None:
        """The ghost at a target, and the tool's path to it."""
        self._target_deg = target_deg
        self._page.show_ghost(target_deg)
        with suppress(ArmtempoError):
            self._page.show_way(target_deg)

    async def _show_typed(self, kind: str) -> None:
        finds: list[Callable[[], Array]] = []
        if self._page.attempt(lambda: finds.append(self._typed(kind))):
            found_deg = await self._page.threaded(finds[0])
            if found_deg is not None:
                self._show(found_deg)

    def _typed(self, kind: str) -> Callable[[], Array]:
        """What finds the angles of the typed target, (J,), and raises PlanError if no posture reaches it.

        A pose out of reach is searched for half a second, in which no page may wait. Raises InputError if no target
        is typed.
        """
        arm, here_deg = self._operator.arm, self._operator.live.angles_deg
        if kind == "angles":
            angles = [_value(field) for field in self._angles]
            return lambda: posture_deg(angles, arm)
        position = [_value(self._pose[name]) for name in words.POSE_FIELDS[:3]]
        turns = [_value(self._pose[name]) for name in words.POSE_FIELDS[3:]]
        wanted = checked(arm.frame(str(self._frame.value)) @ from_rpy(position, turns))
        return lambda: teaching.nearest(arm, wanted, here_deg)

    def _take_present(self) -> None:
        """Fill the fields with where the arm is."""
        angles = self._operator.live.angles_deg
        for field, angle in zip(self._angles, angles, strict=True):
            field.set_value(round(float(angle), 3))
        arm = self._operator.arm
        pose = np.linalg.inv(arm.frame(str(self._frame.value))) @ forward(arm, angles)
        values = [*pose[:3, 3], *to_rpy_deg(pose)]
        for field, value in zip(self._pose.values(), values, strict=True):
            field.set_value(round(float(value), 2) + 0.0)

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


def _number(name: str, value: float) -> ui.number:
    field = ui.number(words.plain(name), value=value, format="%.3f").props("dense outlined")
    return field.classes("armtempo-value")


def _value(field: ui.number) -> float:
    if field.value is None:
        raise InputError(f"{field.props['label']}: no number is given", "type one")
    return float(field.value)


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


def build(page: PanelPage) -> None:
    """The tab."""
    MoveTab(page)
