"""Targets of the arm: its postures, angles or a pose that are typed; each is shown before the arm moves there."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from nicegui import ui

from armtempo.basics.arrays import Array
from armtempo.basics.errors import ArmtempoError, InputError
from armtempo.kinematics.of_arm import forward
from armtempo.model.pose import checked, from_rpy, to_rpy_deg
from armtempo.model.tool_pose import BASE
from armtempo.panel import arm_scene, teaching, words
from armtempo.panel.hold import SHOWN_S
from armtempo.panel.panel_page import named
from armtempo.robot.goto import MovePace, posture_deg

if TYPE_CHECKING:
    from armtempo.panel.panel_page import PanelPage
    from armtempo.panel.press import Press

_SAME_DEG = 1e-3
_THERE_DEG = 0.1
"""An arm that is this close to a target has arrived."""


class Targets:
    """The part of a page where they are chosen."""

    def __init__(self, page: PanelPage) -> None:
        self._page = page
        self._operator = page.operator
        self._target_deg: Array | None = None
        """What the ghost shows."""
        self._found_deg: Array | None = None
        """A target that a thread found, and that is to be shown."""
        with ui.row():
            ui.label(words.GO_TO).classes("text-subtitle2")
            self._one_click = ui.switch(words.ONE_CLICK)
        self._posture_buttons()
        page.expansion(words.TYPED_TARGET, self._typed_target)
        ui.label(words.TARGET_HINT).classes("armtempo-note")
        page.on_look(self._look)
        page.on_arm(self._posture_buttons.refresh)

    def _typed_target(self) -> None:
        page, arm = self._page, self._operator.arm
        with ui.row():
            kind = ui.toggle({"angles": words.ANGLES, "pose": words.POSE}, value="angles")
            named(kind.props("dense no-caps unelevated"), words.FORM_OF_TARGET)
            line = ui.switch(words.IN_A_LINE)
            ui.button(words.TAKE_PRESENT, on_click=self._take_present).props("flat dense no-caps")
        with ui.row().classes("armtempo-fields").bind_visibility_from(kind, "value", value="angles"):
            self._angles = [
                _number(joint.labelled, angle) for joint, angle in zip(arm.driven, arm.home_deg, strict=True)
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


def _number(name: str, value: float) -> ui.number:
    field = ui.number(words.plain(name), value=value, format="%.3f").props("dense outlined")
    return field.classes("armtempo-value")


def _value(field: ui.number) -> float:
    if field.value is None:
        raise InputError(f"{field.props['label']}: no number is given", "type one")
    return float(field.value)


def build(page: PanelPage) -> None:
    """The part of a page."""
    Targets(page)
