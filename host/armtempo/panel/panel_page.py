"""A browser's page: common parts of its tabs, and when each of its controls can be used."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Awaitable, Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from nicegui import background_tasks, run, ui
from nicegui.element import Element
from nicegui.elements.mixins.disableable_element import DisableableElement

from armtempo.basics.arrays import Array
from armtempo.basics.errors import ArmtempoError, InputError
from armtempo.kinematics.chain import chains_mm
from armtempo.model.arm import Arm
from armtempo.panel import arm_scene, live_texts, words
from armtempo.panel.arm_scene import ArmScene, ArmShape
from armtempo.panel.hold import ButtonHold
from armtempo.panel.panel_board import Needs, PanelBoard
from armtempo.panel.press import Press
from armtempo.robot.board import Board

T = TypeVar("T")
_WAY_POINTS = 40
_PLAY_S = 0.05
_ROWS_AT_ONCE = 8
LOOK_S = 0.25
"""Interval at which a page updates, except for moving parts."""


@dataclass
class _Control:
    """A control of the page, and its requirements."""

    element: Element
    why_not: Callable[[], str]
    is_held: bool
    """Whether it acts while it is held."""
    reason: str = "-"
    """Why it cannot be pressed."""

    def grey(self, reason: str) -> None:
        """Disable it, with the reason as its hint, unless that is \"\"."""
        if reason == self.reason:
            return
        self.reason = reason
        self.element.set_enabled(not reason)  # type: ignore[attr-defined]
        for hint in self.element.default_slot.children:
            if isinstance(hint, ui.tooltip):
                hint.set_text(words.of_text(reason))
                hint.set_visibility(bool(reason))


@dataclass(frozen=True)
class Asked:
    """A dialog."""

    dialog: ui.dialog
    place: ui.column
    """Between the question and the buttons."""


@dataclass
class PanelPage:
    """A browser's page: common parts of its tabs."""

    operator: PanelBoard
    hold: ButtonHold
    shape: ArmShape
    client: str
    controls: list[_Control] = field(default_factory=list)
    """The controls that need something."""
    shown: str = ""
    """The tab that is shown."""
    built: str = ""
    """The tab that is being built; "" for what is in view on every tab."""
    listeners: list[tuple[str, Callable[[], None]]] = field(default_factory=list)
    """Called every LOOK_S while their tab is shown; without a tab, always."""
    arm_listeners: list[Callable[[], object]] = field(default_factory=list)
    """Called when the arm has changed: its postures, workspace, frames, tools, or the chosen tool."""
    holds: list[Callable[[Press], None]] = field(default_factory=list)
    """What the hold buttons begin, by number."""
    jog_percent: float = 25.0
    """Speed of jogs and of moves to a target, percent of the limits."""
    picture: Element = field(init=False)
    """The place of the scene."""
    _arm: Arm = field(init=False)
    speeds: ui.label = field(init=False)
    """What the colours of the planned path mean."""

    _texts: dict[str, str] = field(init=False)
    """What the page says of the arm before its first message."""
    _playing: object = None
    """What is played on the model; another object for each time."""

    def __post_init__(self) -> None:
        """The controls are built for the arm as it is now."""
        self._arm = self.operator.arm
        self._texts = live_texts.texts(self.operator)

    @cached_property
    def scene(self) -> ArmScene:
        """The arm in 3-D, made when it is first needed, so that the first view does not wait for it."""
        with self.picture:
            scene = ArmScene(self.shape)
            ui.run_javascript(f"armtempo.show({scene.parts})")
        return scene

    def live_label(self, place: str) -> ui.label:
        """A place of ``live_texts``, with its text when the page was asked for."""
        made = ui.label(self._texts[place])
        made.props["id"] = place
        return made

    def control(
        self,
        element: Element,
        needs: Needs | None = Needs.MOVE,
        more: Callable[[], str] = str,
        is_held: bool = False,
    ) -> Element:
        """An element that is disabled, with the reason as its hint, while it cannot be used.

        ``needs``: None if a page without control can use it too. ``more``: a further reason, "" if there is none.
        """
        with element:
            ui.tooltip("")

        def why_not() -> str:
            return (self.operator.why_not(self.client, needs) if needs is not None else "") or more()

        control = _Control(element, why_not, is_held)
        control.grey(control.why_not())
        self.controls.append(control)
        return element

    def button(
        self,
        text: str,
        call: Callable[[Press], object],
        needs: Needs | None = Needs.MOVE,
        more: Callable[[], str] = str,
        look: str = "outline",
        name: str = "",
    ) -> ui.button:
        """A button that gives a command: ``call`` gets what the page says of the press.

        ``look``: how Quasar draws it, and its icon; ``name``: for screen readers, if it has no text.
        """
        made = ui.button(text).props(f"{look} no-caps")
        if name:
            named(made, name)
        self.on_press(made, "click", lambda press, _: call(press))
        self.control(made, needs, more)
        return made

    def on_press(self, element: Element, event: str, call: Callable[[Press, Any], object]) -> None:
        """Call ``call`` with what the page says of a press, and with the value of the event, if it has one.

        A press that comes just after the element was disabled is refused with the reason.
        """

        def pressed(event: Any) -> Any:
            said, value = event.args
            found: list[object] = []

            def take() -> None:
                for control in self.controls:
                    if control.element is element and (reason := control.why_not()):
                        raise InputError(reason, words.WAIT)
                found.append(call(Press.of(said), value))

            self.answer(said, self.refusal(take))
            return found[0] if found else None

        if isinstance(element, DisableableElement):
            element.ignores_events_when_disabled = False
        element.on(event, pressed, js_handler="(event) => armtempo.command(event, emit)")

    def answer(self, said: Any, refusal: str) -> None:
        """Tell the page why its last press was refused; "" if it was taken."""
        number = said.get("number") if isinstance(said, dict) else None
        ui.run_javascript(f"armtempo.answered = {json.dumps([number, refusal])}")

    def hold_button(
        self,
        text: str,
        begin: Callable[[Press], None],
        more: Callable[[], str] = str,
        look: str = "outline",
        name: str = "",
    ) -> ui.button:
        """A button that moves the arm while it is held; the page's script finds it by its number."""
        made = ui.button(text).props(f"{look} no-caps data-hold={len(self.holds)}").classes("armtempo-hold")
        if name:
            named(made, name)
        self.control(made, more=more, is_held=True)
        self.holds.append(begin)
        return made

    def ask(
        self,
        question: str,
        text: str,
        call: Callable[[Press], object],
        closed: Callable[[], object] = lambda: None,
    ) -> Asked:
        """Ask, and give a command with the button ``text`` of the dialog; ``closed`` is called when it is gone."""
        # A dialog of its own, also where one opens it; seamless, as nothing may cover stop and the picture
        with ui.context.client, ui.dialog().props("seamless position=right") as asked, ui.card():
            if question:
                ui.label(question)
            place = ui.column()
            with ui.row():
                yes = ui.button(text).props("no-caps")
                ui.button(words.CANCEL, on_click=asked.close).props("flat no-caps").classes("armtempo-cancel")

        def answered(press: Press, _: object) -> object:
            found = call(press)
            asked.close()
            return found

        def hidden() -> None:
            closed()
            asked.delete()

        self.on_press(yes, "click", answered)
        asked.on("hide", hidden)
        asked.open()
        return Asked(asked, place)

    def build(self, tab: str, call: Callable[[], object]) -> None:
        """Build a part of a tab."""
        for _ in self.parts(tab, call):
            pass

    def parts(self, tab: str, call: Callable[[], object]) -> Iterator[None]:
        """Build a part of a tab; a call that gives an iterator builds with pauses, one for each item."""
        self.built = tab
        try:
            if isinstance(built := call(), Iterator):
                yield from built
        finally:
            self.built = ""

    def expansion(self, text: str, call: Callable[[], object]) -> ui.expansion:
        """A folded part that ``call`` builds when it is first opened: the first view does not wait for it."""
        tab = self.built
        place = ui.expansion(text).props("dense").classes("armtempo-expansion")

        def opened() -> None:
            if not place.default_slot.children:
                with place:
                    self.build(tab, call)

        place.on_value_change(opened)
        return place

    def on_look(self, listener: Callable[[], None]) -> None:
        """Call ``listener`` every LOOK_S; from within a tab, only while that is shown."""
        self.listeners.append((self.built, listener))

    def on_arm(self, listener: Callable[[], object]) -> None:
        """Call ``listener`` when the arm has changed, also by another page."""
        self.arm_listeners.append(listener)

    def do(self, press: Press, what: str, call: Callable[[], object], needs: Needs = Needs.MOVE) -> None:
        """Start a command of the operator; raises InputError if it is refused."""
        self.operator.do(what, self.client, press, call, needs)

    def attempt(self, call: Callable[[], object]) -> bool:
        """Call something; show the library's error and return False if it fails."""
        return not self.refusal(call)

    def refusal(self, call: Callable[[], object]) -> str:
        """Call something; show and return the library's error; "" if there is none."""
        try:
            call()
        except ArmtempoError as error:
            _say(error)
            return words.of_error(error)
        return ""

    def at_once(
        self, press: Press, call: Callable[[Board], object], needs: Needs = Needs.BOARD
    ) -> Awaitable[object]:
        """Call something on the board at once, also during a command; raises InputError if it is refused."""
        self.operator.check(self.client, press, needs)
        return self.threaded(lambda: call(self.operator.board))

    async def threaded(self, call: Callable[[], T]) -> T | None:
        """Run ``call`` in a thread, so that no page waits; show an error."""
        try:
            return await run.io_bound(call)
        except ArmtempoError as error:
            _say(error)
            return None

    def show_ghost(self, angles_deg: Array | None) -> None:
        """Show a ghost of the arm at these angles, (J,), on this page only; None: none."""
        poses = json.dumps(None if angles_deg is None else self.shape.poses(angles_deg))
        ui.run_javascript(f"armtempo.ghost = {poses}")

    async def play(self, total_s: float, show: Callable[[float], object]) -> bool:
        """Show the times of a motion as they pass; whether that was to its end."""
        self._playing = mine = object()
        begin_s = time.monotonic()
        while self._playing is mine and (time_s := time.monotonic() - begin_s) < total_s:
            show(time_s)
            await asyncio.sleep(_PLAY_S)
        if self._playing is not mine:
            return False
        self._playing = None
        show(total_s)
        return True

    @property
    def is_playing(self) -> bool:
        """Whether a motion is played on the model."""
        return self._playing is not None

    def stop_playing(self) -> None:
        """End the playing."""
        self._playing = None

    def show_way(self, target_deg: Array) -> None:
        """Draw the way of the tool from where the arm is to these angles, (J,), on this page only."""
        arm, here_deg = self.operator.arm, self.operator.live.angles_deg
        parts = np.linspace(0.0, 1.0, _WAY_POINTS)[:, None]
        self.scene.draw(
            "way", chains_mm(arm, here_deg + parts * (target_deg - here_deg))[:, -1], arm_scene.WAY
        )

    def refresh(self) -> None:
        """Disable controls that cannot be used now, with the reason."""
        if self.operator.arm is not self._arm:
            self._arm = self.shape.arm = self.operator.arm
            self.scene.draw_workspace()
            self.scene.draw_frames()
            for changed in self.arm_listeners:
                changed()
        self.controls = [control for control in self.controls if not control.element.is_deleted]
        for control in self.controls:
            # a held button keeps the keyboard's focus
            if not (control.is_held and self.hold.held_by(self.client)):
                control.grey(control.why_not())
        for tab, listener in self.listeners:
            if tab in ("", self.shown):
                listener()


def build_rows(place: Element, count: int, row: Callable[[int], object]) -> None:
    """Build rows in a place, the first at once, the others with a pause after each.

    One takes 5 to 10 ms, and stop and the buttons that are held must not wait for a hundred.
    """

    async def others() -> None:
        for number in range(_ROWS_AT_ONCE, count):
            await asyncio.sleep(0)
            if place.is_deleted:  # it is built anew, or the page is closed
                return
            with place:
                row(number)

    with place:
        for number in range(min(count, _ROWS_AT_ONCE)):
            row(number)
    if count > _ROWS_AT_ONCE:
        background_tasks.create(others())


def named(element: Element, name: str) -> Element:
    """An element with its name for screen readers: as a value, which a name from a file cannot leave."""
    element.props["aria-label"] = words.plain(name)
    return element


def _say(error: ArmtempoError) -> None:
    """Show an error on this page."""
    ui.notify(words.of_error(error), type="negative", multi_line=True, timeout=8000)
