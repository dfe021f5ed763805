"""What is wrong now, and the button that helps: the banner on every page."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, auto
from functools import partial
from typing import TYPE_CHECKING

from nicegui import ui

from armtempo.panel import words
from armtempo.panel.panel_board import Needs, PanelBoard

if TYPE_CHECKING:
    from armtempo.panel.panel_page import PanelPage
    from armtempo.panel.press import Press


class Cure(Enum):
    """What helps."""

    CLEAR = auto()
    """Clear the fault."""
    HOME = auto()
    """Home the arm."""
    DEPLOY = auto()
    """Put the program on the board."""
    DISMISS = auto()
    """It is over; the message stays until it was read."""


@dataclass(frozen=True)
class Problem:
    """A problem of the board or the arm."""

    text: str
    cures: tuple[Cure, ...]
    is_fault: bool = True
    """Whether it is shown in red; else it is a step that is still to be done."""


def of(operator: PanelBoard) -> Problem | None:
    """The most important one; None if nothing is wrong."""
    live = operator.live
    is_known = live.state is None or live.known  # one that is deployed to says nothing
    if operator.trouble and (operator.has_board or not operator.busy):
        return Problem(operator.trouble, () if operator.has_board else (Cure.DEPLOY,))
    if live.fault:
        return Problem(words.of_text(live.fault), (Cure.CLEAR,))
    if live.doubt:
        return Problem(live.doubt, (Cure.HOME,))
    if operator.failure:
        return Problem(operator.failure, (Cure.DISMISS,) if is_known else (Cure.HOME, Cure.DISMISS))
    if not is_known and not operator.busy:
        return Problem(words.FIRST_HOME, (Cure.HOME,), is_fault=False)
    return None


def build(page: PanelPage) -> None:
    """The banner of a page."""
    operator = page.operator
    with ui.element("div").classes("armtempo-banner").props('role="alert"') as banner:
        text = ui.label("").classes("armtempo-problem")
        buttons = {cure: _button(page, cure) for cure in Cure}
    shown: list[Problem | None] = [Problem("", ())]

    def look() -> None:
        problem = of(operator)
        if problem == shown[0]:
            return
        shown[0] = problem
        banner.set_visibility(problem is not None)
        if problem is not None:
            text.set_text(words.plain(problem.text))
            kind, other = ("armtempo-fault", "armtempo-first")[:: 1 if problem.is_fault else -1]
            banner.classes(add=kind, remove=other)
            for cure, button in buttons.items():
                button.set_visibility(cure in problem.cures)

    page.on_look(look)
    look()


def _button(page: PanelPage, cure: Cure) -> ui.button:
    operator = page.operator

    def clear(press: Press) -> None:
        page.do(press, words.CLEAR, lambda: operator.board.clear(), Needs.COMMAND | Needs.FAULT)

    def dismiss(press: Press) -> None:
        operator.failure = ""

    def deploy(press: Press) -> None:
        page.do(press, words.DEPLOY, operator.deploy, Needs.IDLE)

    from armtempo.panel import homing

    rows: dict[Cure, tuple[str, Callable[[Press], object], Needs | None]] = {
        Cure.CLEAR: (words.CLEAR, clear, Needs.COMMAND | Needs.FAULT),
        Cure.HOME: (words.HOMING, partial(homing.ask, page), Needs.COMMAND),
        Cure.DEPLOY: (words.DEPLOY, lambda _: page.ask(words.SURE_DEPLOY, words.DEPLOY, deploy), Needs.IDLE),
        Cure.DISMISS: (words.DISMISS, dismiss, None),
    }
    text, call, needs = rows[cure]
    return page.button(text, call, needs, look="outline color=white")
