"""Frames and tools that are taught step by step: the arm is brought to each point, by jogs or by hand."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from nicegui import ui

from armtempo.basics.errors import InputError
from armtempo.model import frame, taught, tool
from armtempo.panel import teaching, words
from armtempo.panel.panel_board import Needs
from armtempo.panel.panel_page import named
from armtempo.robot.teaching import NewFrame, NewTable, NewTool

if TYPE_CHECKING:
    from armtempo.panel.panel_page import PanelPage
    from armtempo.panel.press import Press


class TeachPoints:
    """The part of a page in which a frame or a tool is taught."""

    def __init__(self, page: PanelPage) -> None:
        self._page = page
        self._operator = page.operator
        self._new: NewTable | None = None
        """What is being taught; None before it was begun."""
        self._tool = ""
        """The tool with which its points are taken."""
        self._points_deg: list[list[float]] = []
        self._said = ""
        """How accurate the last one is."""
        page.expansion(words.TEACH_POINTS, self._steps)

    @ui.refreshable_method
    def _steps(self) -> None:
        page, new = self._page, self._new
        if new is None:
            with ui.row():
                kinds = ui.toggle(words.TAUGHT_KINDS, value=frame.KIND)
                named(kinds.props("dense no-caps unelevated"), words.WHAT_IS_TAUGHT)
                name = ui.input(words.NAME_OF_POSTURE).props("dense outlined").classes("armtempo-value")
                named(name, words.NAME_OF_TAUGHT)
                level = ui.switch(words.LEVEL).bind_visibility_from(kinds, "value", value=frame.KIND)

                def begin(press: Press) -> None:
                    self._ask(str(kinds.value), str(name.value or "").strip(), level.value, press)

                page.button(words.BEGIN, begin, Needs.CONTROL)
            for kind, hint in words.TAUGHT_HINTS.items():
                ui.label(hint).classes("armtempo-note").bind_visibility_from(kinds, "value", value=kind)
            ui.label(self._said).classes("armtempo-taught").props('role="status"')
            return
        taken, points = len(self._points_deg), new.points
        ui.label(words.TEACHING.format(kind=words.TAUGHT_KINDS[new.kind], name=words.plain(new.name)))
        for number, point in enumerate(points):
            mark = words.TAKEN if number < taken else words.NEXT if number == taken else ""
            label = ui.label(f"{number + 1}  {point}{mark}")
            label.classes("text-weight-bold" if number == taken else "armtempo-note")
        with ui.row():
            page.button(
                words.TAKE_POINT, self._take, Needs.BOARD, self._why_no_point, "outline icon=add_location"
            )
            page.button(words.UNDO, self._undo, Needs.CONTROL, lambda: "" if taken else words.NOTHING_TO_UNDO)
            page.button(words.STORE, self._store, Needs.CONTROL, self._why_no_store, "unelevated")
            page.button(words.CANCEL, self._end, None, look="flat")

    def _ask(self, kind: str, name: str, level: bool, press: Press) -> None:
        """Begin, after a question if there is one of this name, which stays until the new one is stored."""
        operator = self._operator
        operator.check(self._page.client, press, Needs.CONTROL)
        place = teaching.arm_file(operator.arm), (kind, name)
        begin = partial(self._begin, kind, name, level)
        if name in taught.names(place[0], kind):
            kinds = words.TAUGHT_KINDS[kind].lower()
            self._page.ask(
                words.SURE_REPLACE.format(kind=kinds, name=words.plain(name)), words.TEACH_ANEW, begin
            )
        else:
            begin(press)

    def _begin(self, kind: str, name: str, level: bool, press: Press) -> None:
        operator = self._operator
        arm, file = operator.arm, teaching.arm_file(operator.arm)
        self._new = (
            NewTool(file, arm, name, replace_old=True)
            if kind == tool.KIND
            else NewFrame(file, arm, name, level, replace_old=True)
        )
        self._tool, self._points_deg, self._said = operator.tool, [], ""
        self._steps.refresh()

    def _why_no_point(self) -> str:
        live, new = self._operator.live, self._new
        if new is None or len(self._points_deg) == len(new.points):
            return words.ALL_TAKEN
        if self._tool != self._operator.tool and isinstance(new, NewFrame):
            return words.OTHER_TOOL
        if not live.known:
            return words.NOT_HOMED
        return words.MOVING if live.state is not None and live.state.moving else ""

    def _why_no_store(self) -> str:
        new = self._new
        return words.MORE_POINTS if new is None or len(self._points_deg) < len(new.points) else ""

    def _take(self, press: Press) -> None:
        """Take where the arm is as the next point."""
        operator, new = self._operator, self._new
        operator.check(self._page.client, press, Needs.BOARD)
        if new is None or (reason := self._why_no_point()):
            raise InputError(reason if new else words.ALL_TAKEN, words.WAIT)
        arm = operator.arm
        point = taught.digits(arm, [float(angle) for angle in operator.live.angles_deg])
        if outside := arm.angles_problem(point):
            raise InputError(outside, words.INTO_RANGE)
        new.check([*self._points_deg, point])
        self._points_deg.append(point)
        self._steps.refresh()

    def _undo(self, press: Press) -> None:
        self._operator.check(self._page.client, press, Needs.CONTROL)
        del self._points_deg[-1:]
        self._steps.refresh()

    def _store(self, press: Press) -> None:
        self._operator.check(self._page.client, press, Needs.CONTROL)
        if (new := self._new) is None:
            return
        said = new.save(self._points_deg)
        for line in said:
            self._operator.say(line)
        teaching.read_again(self._page)
        self._new, self._said = None, "\n".join(said)
        self._steps.refresh()

    def _end(self, press: Press) -> None:
        self._new = None
        self._steps.refresh()


def build(page: PanelPage) -> None:
    """The part of a page."""
    TeachPoints(page)
