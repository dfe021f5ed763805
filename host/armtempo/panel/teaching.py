"""Targets and postures: a typed pose, the present posture under a name, the arm guided by hand."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from nicegui import ui

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.model import taught
from armtempo.model.arm import Arm
from armtempo.model.pose import to_rpy_deg
from armtempo.model.tool_pose import Pose
from armtempo.panel import words
from armtempo.panel.panel_board import Needs
from armtempo.planning import via_points

if TYPE_CHECKING:
    from armtempo.panel.panel_page import PanelPage
    from armtempo.panel.press import Press

_LOOK_S = 0.05


def nearest(arm: Arm, wanted: Array, here_deg: Array) -> Array:
    """The angles, (J,), nearest to ``here_deg`` (J,) that bring the tool to a pose in the base, (4, 4).

    Of the orientation an arm with less than six joints takes what it can: its direction, its pitch, nothing. Raises
    PlanError if no posture reaches it.
    """
    position_mm = wanted[:3, 3].tolist()
    pose = {
        6: lambda: Pose.of_matrix(wanted),
        5: lambda: Pose.of_approach(position_mm, wanted[:3, 2].tolist()),
        4: lambda: Pose.of_angles(position_mm, {"pitch": to_rpy_deg(wanted).pitch_deg}),
    }.get(len(arm.driven), lambda: Pose.of_angles(position_mm, {}))()
    return via_points.nearest(arm, pose, here_deg.tolist())


def ask(page: PanelPage) -> None:
    """Store the present posture: under a name in the arm file, or as a via point of the job."""
    operator = page.operator
    angles = taught.digits(operator.arm, [float(angle) for angle in operator.live.angles_deg])

    def store(press: Press) -> None:
        operator.check(page.client, press, Needs.CONTROL)
        wanted = str(name.value or "").strip()
        if any(posture.name == wanted for posture in operator.arm.postures) and not replace.value:
            raise InputError(words.HAS_POSTURE.format(name=wanted), words.REPLACE_HINT)
        taught.save(arm_file(operator.arm), operator.arm, wanted, angles, replace.value)
        read_again(page)
        operator.say(words.TAUGHT.format(name=wanted))

    def add(press: Press) -> None:
        operator.check(page.client, press, Needs.CONTROL)
        operator.jobs.insert(len(operator.jobs.vias), angles)
        asked.dialog.close()

    asked = page.ask(words.TEACH_HINT, words.STORE, store)
    with asked.place:
        pairs = zip(angles, operator.arm.driven, strict=True)
        ui.label("  ".join(f"{angle:g}{joint.unit.sign}" for angle, joint in pairs)).classes(
            "text-weight-bold"
        )
        name = ui.input(words.NAME_OF_POSTURE).props("dense outlined")
        replace = ui.switch(words.REPLACE)
        page.button(words.ADD_TO_JOB, add, Needs.CONTROL)


def read_again(page: PanelPage) -> None:
    """Take the arm with its new postures, frames or tools, which the board does not know."""
    page.operator.arm_changed(Arm.read(arm_file(page.operator.arm)))
    page.refresh()


def arm_file(arm: Arm) -> Path:
    """The file of an arm; raises InputError for one that ships, which is no file of the project."""
    file = Path(arm.source)
    if not file.is_file() or not file.resolve().is_relative_to(Path().resolve()):
        raise InputError(
            f"the arm {arm.name!r} is no file in the project folder",
            "make a project with its file: 'armtempo new'",
        )
    return file


def by_hand(page: PanelPage, _: Press) -> None:
    """Ask, then switch the motors' current off until the dialog's button ends it."""
    page.ask(words.SURE_BY_HAND, words.BY_HAND, lambda press: _guide(page, press))


def _guide(page: PanelPage, press: Press) -> None:
    operator = page.operator

    def work() -> None:
        with operator.board.by_hand() as guided:
            operator.live.guided = True
            try:
                while operator.guiding and operator.holder == page.client:
                    operator.live.angles_deg = np.array(guided.angles_deg())
                    time.sleep(_LOOK_S)
            finally:
                operator.live.guided = False

    operator.guiding = True
    page.do(press, words.BY_HAND.rstrip("…"), work, Needs.MOVE)

    def end(press: Press) -> None:
        operator.guiding = False

    page.ask(words.GUIDING, words.GUIDED, end, lambda: setattr(operator, "guiding", False))
